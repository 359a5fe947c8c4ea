// From 48 simulated photographs with known poses and masks to a surface: stage by stage the time,
// processor time and memory, then accuracy and completeness against the exact truth, beside what
// others reach on such work.

#include <fmt/format.h>
#include <sys/resource.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/photogrammetry/bench_scene.h"
#include "bench/photogrammetry/surface_measures.h"
#include "core/parallel.h"
#include "core/session/image_file.h"
#include "core/session/session.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/photogrammetry/reconstruct_surface.h"

namespace skullstation {
namespace {

struct Options {
  BenchScene scene;
  std::string cache;
  std::string folder;
  std::string out;
  ReconstructionQuality quality = ReconstructionQuality::standard;
  int threads = 0;
};

/// Prints what passed since the last stage: the processor's time counts on a busy machine.
class Stopwatch {
 public:
  void lap(std::string_view stage) {
    const double wall = wall_s() - wall_, processor = processor_s() - processor_;
    total_wall_ += wall;
    total_processor_ += processor;
    print(stage, wall, processor);
    wall_ = wall_s();
    processor_ = processor_s();
  }
  void total() const { print("all stages", total_wall_, total_processor_); }

 private:
  static double wall_s() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double>(now).count();
  }
  static double processor_s() {
    timespec used{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  }
  static void print(std::string_view stage, double wall, double processor) {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    fmt::print("{:<20} {:>9.1f} {:>9.1f} {:>9}\n", stage, wall, processor, usage.ru_maxrss / 1024);
    std::fflush(stdout);
  }

  double wall_ = wall_s(), processor_ = processor_s();
  double total_wall_ = 0.0, total_processor_ = 0.0;
};

Result<StereoView> load_view(const Session& session, const SessionView& view,
                             const std::filesystem::path& folder) {
  const auto photograph = read_image(folder / view.image);
  if (!photograph) return forward(photograph);
  const auto mask = read_image(folder / view.mask.value_or(""));
  if (!mask) return forward(mask);
  for (const SessionCamera& camera : session.cameras) {
    if (camera.id != view.camera || !camera.params || !view.camera_from_table) continue;
    const Lens lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
    return make_stereo_view(view.image, *photograph, *mask, lens, *view.camera_from_table,
                            view.pass);
  }
  return fail(ErrorKind::bad_input, view.image, "has no intrinsics or no pose");
}

Result<std::vector<StereoView>> load_views(const std::filesystem::path& folder, int threads) {
  const auto session = read_session(folder);
  if (!session) return forward(session);
  const auto count = static_cast<int>(session->views.size());
  std::vector<std::optional<Result<StereoView>>> loaded(count);
  parallel_for(count, threads,
               [&](int i) { loaded[i] = load_view(*session, session->views[i], folder); });
  std::vector<StereoView> views;
  for (auto& view : loaded) {
    if (!*view) return forward(*view);
    views.push_back(**std::move(view));
  }
  return views;
}

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
}

Result<void> run(const Options& options) {
  std::filesystem::path folder = options.folder;
  if (folder.empty()) {
    const auto made = cached_scene(options.scene, options.cache, options.threads);
    if (!made) return forward(made);
    folder = *made;
  }
  fmt::print("scene {}\n{:<20} {:>9} {:>9} {:>9}\n", folder.string(), "", "wall s", "CPU s",
             "peak MB");
  const auto start = std::chrono::steady_clock::now();
  Stopwatch watch;
  const auto views = load_views(folder, options.threads);
  if (!views) return forward(views);
  watch.lap("load and undistort");
  SurfaceOptions how = SurfaceOptions::of(options.quality, *views);
  how.threads = options.threads;
  how.after_stage = [&](std::string_view stage) { watch.lap(stage); };
  const auto surface = reconstruct_surface(*views, how);
  if (!surface) return forward(surface);
  watch.total();
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  const auto truth = read_ply(folder / "truth.ply");
  if (!truth) return forward(truth);
  const auto measures = measure_surface(surface->mesh, *truth, *views, options.threads);
  if (!measures) return forward(measures);
  print_accuracy(*measures, wall_s);
  fmt::print("voxel {:.2f} mm, {} vertices, {} triangles, border {:.0f} mm\n", how.fusion.voxel_mm,
             surface->mesh.vertices.rows(), surface->mesh.triangles.rows(),
             surface->coverage.open_edge_mm);
  if (options.out.empty()) return {};
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
  if (const auto done = skullstation::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
