// Two passes of one specimen, the second laid down anew at random again and again: is it always
// found, and how nearly in the same place?
//   bench_join FIRST.ply SECOND.ply [--placements 20] [--seed 1]
// The surfaces are what `skullstation reconstruct` makes of a session's passes by themselves.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/random.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/photogrammetry/poses_join.h"

namespace {

using namespace skullstation;

Eigen::Quaterniond random_rotation(Random& random) {
  return Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
      .normalized();
}

/// Largest displacement between two placements over the second surface's corners [mm].
double apart_mm(const Rigid3& a, const Rigid3& b, const TriangleMesh& mesh) {
  const Eigen::RowVector3d low = mesh.vertices.colwise().minCoeff();
  const Eigen::RowVector3d high = mesh.vertices.colwise().maxCoeff();
  double worst = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d x((corner & 1) != 0 ? high.x() : low.x(),
                            (corner & 2) != 0 ? high.y() : low.y(),
                            (corner & 4) != 0 ? high.z() : low.z());
    worst = std::max(worst, (a * x - b * x).norm());
  }
  return worst;
}

int run(const std::string& first_file, const std::string& second_file, int placements,
        std::uint64_t seed) {
  const auto first = read_ply(first_file);
  const auto second = read_ply(second_file);
  if (!first || !second) {
    fmt::print(stderr, "{}\n", (!first ? first : second).error().message());
    return 1;
  }
  Random random(seed);
  std::vector<Rigid3> found;  // first_from_second, of the surface as it lies in its file
  int refused = 0;
  fmt::print("  overlap   rms mm  runner-up  seconds\n");
  for (int i = 0; i < placements; ++i) {
    constexpr double reach_mm = 100.0;
    const Rigid3 moved_from_second{
        random_rotation(random),
        reach_mm * Eigen::Vector3d(random.normal(), random.normal(), random.normal())};
    TriangleMesh moved = *second;
    for (Eigen::Index v = 0; v < moved.vertices.rows(); ++v) {
      moved.vertices.row(v) = (moved_from_second * second->vertices.row(v).transpose()).transpose();
      if (moved.normals.rows() == 0) continue;
      moved.normals.row(v) =
          (moved_from_second.rotation * second->normals.row(v).transpose()).transpose();
    }
    const auto begin = std::chrono::steady_clock::now();
    PassJoinOptions options;
    options.seed = seed + static_cast<std::uint64_t>(i);
    const auto join = join_passes(*first, moved, options);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (!join) {
      ++refused;
      fmt::print("  refused: {}\n", join.error().message());
      continue;
    }
    fmt::print("  {:7.3f}  {:7.4f}  {:9.2f}  {:7.1f}\n", join->overlap, join->rms_mm,
               join->runner_up, seconds);
    found.push_back(join->first_from_second * moved_from_second);
  }
  // The placement that most others agree with stands for the truth.
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> departures;
  for (const Rigid3& candidate : found) {
    std::vector<double> distances;
    for (const Rigid3& other : found) distances.push_back(apart_mm(candidate, other, *second));
    std::ranges::sort(distances);
    if (distances[distances.size() / 2] >= least) continue;
    least = distances[distances.size() / 2];
    departures = distances;
  }
  const auto wrong = std::ranges::count_if(departures, [](double mm) { return mm > 1.0; });
  fmt::print(
      "{} placements: {} refused, {} wrong (more than 1 mm off); places differ by {:.3f} mm "
      "median, {:.3f} mm at most, over the specimen's corners\n",
      placements, refused, wrong, departures.empty() ? 0.0 : least,
      departures.empty() ? 0.0 : departures.back());
  return wrong == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Joins two passes from random placements"};
  std::string first;
  std::string second;
  int placements = 20;
  std::uint64_t seed = 1;
  app.add_option("FIRST", first, "surface of the first pass (.ply)")->required();
  app.add_option("SECOND", second, "surface of the second pass (.ply)")->required();
  app.add_option("--placements", placements, "how often")->check(CLI::Range(1, 1000));
  app.add_option("--seed", seed, "of the placements");
  CLI11_PARSE(app, argc, argv);
  return run(first, second, placements, seed);
}
