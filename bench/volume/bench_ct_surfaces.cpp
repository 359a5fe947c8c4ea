// How long the two surfaces of a CT take, how much memory, how near they are to the truth, and how
// long the spikes are that metal streaks leave on the skin of a scan.

#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bench/seconds.h"
#include "bench/volume/head_with_distances.h"
#include "core/parallel.h"
#include "reconstruction/phantom/phantom_ct_distance.h"
#include "reconstruction/volume/ct_surfaces.h"
#include "reconstruction/volume/morphology.h"
#include "reconstruction/volume/volume_file.h"

namespace skullstation {
namespace {

struct Options {
  std::string scan;
  bool accuracy_only = false;
  int threads = 0;
};

/// 512 x 512 x 300 voxels that hold the synthetic head from the neck up.
VoxelGrid large_grid() {
  VoxelGrid grid;
  grid.size = {512, 512, 300};
  grid.spacing_mm = {0.5, 0.5, 0.8};
  grid.origin_mm = {-128.0, -142.0, -145.0};
  return grid;
}

VoxelGrid accuracy_grid() {
  VoxelGrid grid;
  grid.size = {380, 510, 236};
  grid.spacing_mm = {0.5, 0.5, 1.0};
  grid.origin_mm = {-95.0, -140.0, -145.0};
  return grid;
}

/// Spikes on the skin: how far it reaches, in streaked slices and within 45 mm of metal, beyond
/// what a ball of 3 mm radius can fill from inside. Lips and nasal wings thinner than 6 mm count,
/// too.
Result<void> measure_spikes(const CtSurfaces& surfaces, const CtSurfaceOptions& options) {
  constexpr double kBall_mm = 3.0;
  constexpr double kStreak_mm = 45.0;
  const Volume& scan = surfaces.volume;
  const Eigen::AlignedBox3d box = bounding_box(surfaces.skin);
  VoxelGrid grid;
  grid.origin_mm = box.min() - Eigen::Vector3d::Constant(4.0);
  grid.size = (box.sizes().array() + 9.0).ceil().cast<int>();
  const auto from_skin = voxel_distances(surfaces.skin, grid, 2.0, options.threads);
  if (!from_skin) return forward(from_skin);
  VoxelMask head(grid.size);
  for (std::size_t v = 0; v < head.on.size(); ++v) head.on[v] = from_skin->distance_mm[v] < 0.0F;
  const VoxelMask core = eroded(head, kBall_mm, grid.spacing_mm, options.threads);
  const auto from_core_mm2 = squared_distance_mm2(core, grid.spacing_mm, options.threads);
  std::vector<double> reach_mm;
  for (const StreakedSlices& stack : surfaces.quality.streaks) {
    const int first = std::max(0, stack.first - surfaces.first_slice);
    const int last = stack.last - surfaces.first_slice;
    std::vector<Eigen::Vector3d> metal;
    for (int k = first; k <= last; ++k) {
      for (int j = 0; j < scan.grid.size.y(); j += 2) {
        for (int i = 0; i < scan.grid.size.x(); i += 2) {
          if (scan.at(i, j, k) < options.metal_hu) continue;
          metal.push_back(scan.grid.patient_from_voxel(Eigen::Vector3d(i, j, k)));
        }
      }
    }
    for (Eigen::Index v = 0; v < surfaces.skin.vertices.rows(); ++v) {
      const Eigen::Vector3d place = surfaces.skin.vertices.row(v);
      const double slice = scan.grid.voxel_from_patient(place).z();
      const auto near = [&](const Eigen::Vector3d& m) { return (m - place).norm() < kStreak_mm; };
      if (slice < first || slice > last || std::ranges::none_of(metal, near)) continue;
      const Eigen::Vector3i at = (place - grid.origin_mm).array().round().matrix().cast<int>();
      const double from_core_mm = std::sqrt(from_core_mm2[grid.index(at.x(), at.y(), at.z())]);
      reach_mm.push_back(std::max(0.0, from_core_mm - kBall_mm));
    }
  }
  if (reach_mm.empty()) return {};
  std::ranges::sort(reach_mm);
  const auto long_ones =
      static_cast<double>(reach_mm.end() - std::ranges::upper_bound(reach_mm, 3.0));
  const auto count = static_cast<double>(reach_mm.size());
  fmt::print("{:<24}{:>10.2f}{:>12}\n", "longest skin spike [mm]", reach_mm.back(), "<= 3");
  fmt::print("{:<24}{:>10.2f}\n\n", "longer than 3 mm [%]", 100.0 * long_ones / count);
  return {};
}

Result<void> measure_speed(const Options& options) {
  Result<Volume> volume;
  if (options.scan.empty()) {
    volume = HeadWithDistances::scan(large_grid(), 20.0, 1, options.threads);
  } else {
    volume = read_volume(options.scan, {});
    if (!volume) return forward(volume);
  }
  const Eigen::Vector3i size = volume->grid.size;
  CtSurfaceOptions surface_options;
  surface_options.threads = options.threads;
  const Seconds start = Seconds::now();
  const auto surfaces = extract_ct_surfaces(*std::move(volume), surface_options);
  const Seconds used = Seconds::now() - start;
  if (!surfaces) return forward(surfaces);
  fmt::print("{} x {} x {} voxels, {} threads: skull {} and skin {} vertices\n", size.x(), size.y(),
             size.z(), thread_count(options.threads), surfaces->skull.vertices.rows(),
             surfaces->skin.vertices.rows());
  fmt::print("{:<24}{:>10}{:>12}\n", "", "measured", "reference");
  fmt::print("{:<24}{:>10.2f}{:>12}\n", "wall [s]", used.wall, "<= 20");
  fmt::print("{:<24}{:>10.2f}{:>12}\n", "processor [s]", used.processor, "");
  fmt::print("{:<24}{:>10.2f}{:>12}\n\n", "peak memory [GiB]", peak_memory_gib(), "<= 3");
  return measure_spikes(*surfaces, surface_options);
}

void print_errors(const std::string& what, const TriangleMesh& mesh, double lowest_z_mm,
                  double (*distance_mm)(const Eigen::Vector3d&)) {
  std::vector<double> errors;
  double signed_sum = 0.0;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (mesh.vertices(v, 2) < lowest_z_mm) continue;  // the cap where the volume is cut
    const double error = distance_mm(mesh.vertices.row(v).transpose());
    errors.push_back(std::abs(error));
    signed_sum += error;
  }
  std::ranges::sort(errors);
  double sum = 0.0;
  for (const double error : errors) sum += error;
  const auto count = static_cast<double>(errors.size());
  fmt::print("{:<16}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}{:>10}\n", what, sum / count,
             signed_sum / count, errors[errors.size() * 95 / 100], errors.back(), errors.size());
}

/// At the paper's thresholds, and with the skin at the middle between air and soft tissue: a
/// blurred step crosses -200 HU inside the true surface.
Result<void> measure_accuracy(const Options& options) {
  constexpr int halfway_hu = -480;
  const Volume scan = HeadWithDistances::scan(accuracy_grid(), 10.0, 2, options.threads);
  fmt::print("distance from the exact surface [mm], voxels of 0.5 x 0.5 x 1 mm\n");
  fmt::print("{:<16}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "mean", "signed", "P95", "max",
             "vertices");
  CtSurfaceOptions surface_options;
  surface_options.threads = options.threads;
  for (const int skin_hu : {surface_options.skin_hu, halfway_hu}) {
    surface_options.skin_hu = skin_hu;
    const auto surfaces = extract_ct_surfaces(scan, surface_options);
    if (!surfaces) return forward(surfaces);
    const double lowest_z_mm = surfaces->volume.grid.origin_mm.z() + 2.0;
    if (skin_hu != halfway_hu) {
      print_errors(fmt::format("skull, {} HU", surface_options.bone_hu), surfaces->skull,
                   lowest_z_mm, HeadWithDistances::from_skull_mm);
    }
    print_errors(fmt::format("skin, {} HU", skin_hu), surfaces->skin, lowest_z_mm,
                 HeadWithDistances::from_skin_mm);
  }
  fmt::print("{:<16}{:>10}{:>10}{:>10}\n", "reference", "<= 0.15", "", "<= 0.5");
  return {};
}

Result<void> run(const Options& options) {
  if (!options.accuracy_only) {
    if (const auto done = measure_speed(options); !done) return done;
  }
  if (!options.scan.empty()) return {};
  return measure_accuracy(options);
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("Time, memory and accuracy of the surfaces from CT");
  app.add_option("--scan", options.scan, "measure the time on this scan, not on a synthetic one");
  app.add_flag("--accuracy-only", options.accuracy_only, "leave the time out");
  app.add_option("--threads", options.threads, "0: all");
  CLI11_PARSE(app, argc, argv);
  if (const auto done = skullstation::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
