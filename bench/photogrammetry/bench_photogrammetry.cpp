// From 48 simulated photographs with known poses and masks to a surface: stage by stage the time,
// processor time and memory, then accuracy and completeness against the exact truth, beside what
// others reach on such work.

#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bench/photogrammetry/bench_scene.h"
#include "bench/photogrammetry/bench_views.h"
#include "bench/photogrammetry/bridges.h"
#include "bench/photogrammetry/surface_measures.h"
#include "bench/seconds.h"
#include "core/session/image_file.h"
#include "reconstruction/io/glb.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/photogrammetry/reconstruct_surface.h"

namespace skullstation {
namespace {

struct Options {
  BenchScene scene;
  std::string cache;
  std::string folder;
  std::filesystem::path out;
  ReconstructionQuality quality = ReconstructionQuality::standard;
  int threads = 0;
  bool physics = false;
};

/// Prints what passed since the last stage.
class Stopwatch {
 public:
  void lap(std::string_view stage) {
    const Seconds passed = Seconds::now() - began_;
    total_ = total_ + passed;
    print(stage, passed);
    began_ = Seconds::now();
  }
  void total() const { print("all stages", total_); }

 private:
  static void print(std::string_view stage, const Seconds& seconds) {
    fmt::print("{:<20} {:>9.1f} {:>9.1f} {:>9.0f}\n", stage, seconds.wall, seconds.processor,
               1024.0 * peak_memory_gib());
    std::fflush(stdout);
  }

  Seconds began_ = Seconds::now();
  Seconds total_;
};

void print_accuracy(const SurfaceMeasures& m, double wall_s) {
  constexpr const char* row = "{:<34} {:>7} {:>6} {:>6} {:>6} {:>7} {:>7} {:>7}\n";
  fmt::print("\n");
  fmt::print(row, "", "wall s", "mean", "median", "P95", ">1 mm", "<0.5 mm", "<1 mm");
  fmt::print(row, "", "", "mm", "mm", "mm", "%", "%", "%");
  const auto number = [](double value) { return fmt::format("{:.2f}", value); };
  fmt::print(row, "this surface", fmt::format("{:.0f}", wall_s), number(m.mean_mm),
             number(m.median_mm), number(m.p95_mm), number(m.above_1mm_percent),
             number(m.within_half_mm_percent), number(m.within_1mm_percent));
  fmt::print(row, "asked for", "<=100", "<=0.12", "", "<=0.40", "", ">=94", "");
  fmt::print(row, "OpenMVS 2.3 half size, points", "320", "0.19", "0.10", "0.47", "2.2", "84.7",
             "88.9");
  fmt::print(row, "OpenMVS 2.3 half size, mesh", "533", "0.58", "", "3.6", "8.8", "84.0", "88.0");
  fmt::print(row, "semi-global matching, TSDF", "236", "1.09", "0.47", "3.2", "33", "68", "88");
  fmt::print("surface {:.0f} cm2; truth seen by 3 or more views {:.0f} cm2\n", m.area_cm2,
             m.seen_cm2);
  fmt::print("of it, by the slant of the third best view:");
  for (const SlantMeasures& slant : m.by_slant) {
    fmt::print("  to {:.0f} deg {:.0f} cm2, {:.1f} % < 0.5 mm", slant.most_slant_deg,
               slant.seen_cm2, slant.within_half_mm_percent);
  }
  fmt::print("\n");
}

void print_estimates(const std::array<EstimatedAccuracy, 5>& fifths) {
  fmt::print("stated accuracy against the truth, by fifths of the vertices:\n");
  for (const EstimatedAccuracy& fifth : fifths) {
    fmt::print("  stated {:.3f} mm, is {:.3f} mm, {:.0f} % within twice the statement\n",
               fifth.estimate_mm, fifth.error_mm, fifth.within_twice_percent);
  }
}

/// What the surface has that the specimen has not.
void print_bridges(const std::vector<Bridge>& bridges) {
  double total_cm2 = 0.0;
  std::size_t large = 0;
  for (const Bridge& bridge : bridges) {
    total_cm2 += bridge.area_cm2;
    large += bridge.area_cm2 >= 0.1 ? 1 : 0;
  }
  fmt::print("farther than 1 mm from the truth: {:.1f} cm2 in {} patches, {} of 0.1 cm2 or more\n",
             total_cm2, bridges.size(), large);
  for (std::size_t i = 0; i < std::min<std::size_t>(large, 5); ++i) {
    const Bridge& bridge = bridges[i];
    fmt::print("  {:.2f} cm2, up to {:.1f} mm off, at ({:.0f}, {:.0f}, {:.0f}) mm\n",
               bridge.area_cm2, bridge.most_mm, bridge.middle_mm.x(), bridge.middle_mm.y(),
               bridge.middle_mm.z());
  }
}

Result<std::filesystem::path> scene_of(const Options& options) {
  if (!options.folder.empty()) return std::filesystem::path(options.folder);
  return cached_scene(options.scene, options.cache, options.threads);
}

/// How the error depends on views, noise and resolution: one scene's photographs, fewer and fewer,
/// noisier and noisier, smaller and smaller.
Result<void> print_physics(const Options& options) {
  const auto folder = scene_of(options);
  if (!folder) return forward(folder);
  const auto truth = read_ply(*folder / "truth.ply");
  if (!truth) return forward(truth);
  fmt::print("{:>6} {:>6} {:>9} {:>6} | {:>6} {:>6} {:>6} {:>9} {:>8}\n", "views", "noise",
             "pixel mm", "CPU s", "mean", "median", "P95", "< 1 mm %", "seen cm2");
  const BenchViewOptions variants[] = {{},
                                       {.every = 2},
                                       {.every = 4},
                                       {.every = 6},
                                       {.every = 2, .noise_sd = 2.0},
                                       {.every = 2, .noise_sd = 4.0},
                                       {.every = 2, .noise_sd = 8.0},
                                       {.every = 2, .halvings = 1}};
  std::vector<TriangleMesh> surfaces;
  std::vector<std::string> names;
  for (BenchViewOptions variant : variants) {
    variant.threads = options.threads;
    const auto views = load_bench_views(*folder, variant);
    if (!views) return forward(views);
    SurfaceOptions how = SurfaceOptions::of(options.quality, *views);
    how.threads = options.threads;
    how.texture.reset();
    const Seconds began = Seconds::now();
    const auto surface = reconstruct_surface(*views, how);
    const double passed_s = (Seconds::now() - began).processor;
    if (!surface) {
      fmt::print("{:>6} {:>6} {}\n", views->size(), variant.noise_sd, surface.error().message());
      continue;
    }
    std::vector<float> pixels_mm = surface->coverage.ground_sample_mm;
    const auto middle = pixels_mm.begin() + static_cast<std::ptrdiff_t>(pixels_mm.size() / 2);
    std::nth_element(pixels_mm.begin(), middle, pixels_mm.end());
    const double pixel_mm = *middle;
    const auto m = measure_surface(surface->mesh, *truth, *views, options.threads);
    if (!m) return forward(m);
    fmt::print("{:>6} {:>6} {:>9.2f} {:>6.0f} | {:>6.2f} {:>6.2f} {:>6.2f} {:>9.1f} {:>8.0f}\n",
               views->size(), variant.noise_sd, pixel_mm, passed_s, m->mean_mm, m->median_mm,
               m->p95_mm, m->within_1mm_percent, m->seen_cm2);
    std::fflush(stdout);
    surfaces.push_back(surface->mesh);
    names.push_back(fmt::format("{:>6} {:>6} {:>9.2f}", views->size(), variant.noise_sd, pixel_mm));
  }
  const auto common = measure_what_all_hold(surfaces, *truth, options.threads);
  if (!common) return forward(common);
  fmt::print(
      "\nthe truth's distance from each, on the {:.0f} cm2 that all of them hold\n{:>6} {:>6} "
      "{:>9} | {:>6} {:>6} {:>6}\n",
      common->area_cm2, "views", "noise", "pixel mm", "mean", "median", "P95");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const GapMeasures& m = common->gaps[i];
    fmt::print("{} | {:>6.3f} {:>6.3f} {:>6.2f}\n", names[i], m.mean_mm, m.median_mm, m.p95_mm);
  }
  return {};
}

Result<void> run(const Options& options) {
  const auto made = scene_of(options);
  if (!made) return forward(made);
  const std::filesystem::path& folder = *made;
  fmt::print("scene {}\n{:<20} {:>9} {:>9} {:>9}\n", folder.string(), "", "wall s", "CPU s",
             "peak MB");
  const Seconds start = Seconds::now();
  Stopwatch watch;
  const auto views = load_bench_views(folder, {.threads = options.threads});
  if (!views) return forward(views);
  watch.lap("load and undistort");
  SurfaceOptions how = SurfaceOptions::of(options.quality, *views);
  how.threads = options.threads;
  how.after_stage = [&](std::string_view stage) { watch.lap(stage); };
  const auto surface = reconstruct_surface(*views, how);
  if (!surface) return forward(surface);
  watch.total();
  const double wall_s = (Seconds::now() - start).wall;

  const auto truth = read_ply(folder / "truth.ply");
  if (!truth) return forward(truth);
  const auto measures = measure_surface(surface->mesh, *truth, *views, options.threads);
  if (!measures) return forward(measures);
  print_accuracy(*measures, wall_s);
  print_estimates(
      check_estimates(surface->mesh, surface->coverage.accuracy_mm, *truth, options.threads));
  print_bridges(find_bridges(surface->mesh, *truth, 1.0, options.threads));
  fmt::print("voxel {:.2f} mm, {} vertices, {} triangles, border {:.0f} mm\n", how.fusion.voxel_mm,
             surface->mesh.vertices.rows(), surface->mesh.triangles.rows(),
             surface->coverage.open_edge_mm);
  if (options.out.empty()) return {};
  if (surface->textured) {
    const TexturedSurface& textured = *surface->textured;
    fmt::print("textured: {} triangles, atlas {} px\n", textured.mesh.triangles.rows(),
               textured.atlas.width);
    auto glb = options.out;
    const auto written =
        write_glb(textured.mesh, {textured.coordinates, encode_jpeg(textured.atlas, 92)},
                  glb.replace_extension(".glb"));
    if (!written) return written;
  }
  return write_ply(surface->mesh, options.out);
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  using skullstation::ReconstructionQuality;
  skullstation::Options options;
  CLI::App app("Speed and accuracy of the dense reconstruction");
  app.add_option("--specimen", options.scene.specimen, "PLY mesh in mm; default: synthetic skull");
  app.add_option("--cache", options.cache, "folder where scenes are kept");
  app.add_option("--scene", options.folder, "a session with poses, masks and truth.ply instead");
  app.add_option("--views", options.scene.views, "in two rings")->check(CLI::Range(6, 720));
  app.add_option("--width", options.scene.width, "of the photographs [px]");
  app.add_option("--height", options.scene.height, "of the photographs [px]");
  app.add_option("--out", options.out, "write the surface to this PLY file");
  app.add_flag("--physics", options.physics,
               "a table of error against views, noise and resolution, from one scene");
  app.add_option("--threads", options.threads, "0: all");
  app.add_option("--quality", options.quality, "draft, standard or fine")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ReconstructionQuality>{
          {"draft", ReconstructionQuality::draft},
          {"standard", ReconstructionQuality::standard},
          {"fine", ReconstructionQuality::fine}}));
  CLI11_PARSE(app, argc, argv);
  if (options.cache.empty() && options.folder.empty()) {
    fmt::print(stderr, "give --cache or --scene\n");
    return 2;
  }
  const auto done =
      options.physics ? skullstation::print_physics(options) : skullstation::run(options);
  if (!done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
