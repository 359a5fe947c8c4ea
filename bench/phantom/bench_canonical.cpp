// How near is the canonical skull to a real one? Aligns it with the real skull by similarity and
// prints the distances of all its surfaces both ways, and those of its landmarks from places picked
// by eye on renderings of the real skull. Usage: bench_canonical REAL_SKULL.ply

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string_view>

#include "reconstruction/distance/comparison.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/phantom/skull_landmarks.h"

namespace skullstation {
namespace {

/// Read off orthographic renderings of the real skull with a grid of 10 mm, after it was brought
/// into its anatomical frame and centred by its own mirror symmetry; to about 1 mm.
struct Picked {
  std::string_view name;
  double position_mm[3];
};

constexpr Picked kPicked[] = {
    {"glabella", {0, -83.5, 47}},
    {"nasion", {0, -82.5, 32}},
    {"rhinion", {0, -100.8, 14}},
    {"acanthion", {0, -93.8, -17}},
    {"prosthion", {0, -95, -28}},
    {"bregma", {0, -10, 116.5}},
    {"vertex", {0, 12, 118.5}},
    {"lambda", {0, 97, 57.5}},
    {"opisthocranion", {0, 100, 38}},
    {"infradentale", {0, -92, -50.5}},
    {"pogonion", {0, -93.8, -66}},
    {"menton", {0, -85, -72}},
    {"porion left", {53, 0, 0}},
    {"orbitale left", {33, -73, 0}},
    {"ectoconchion left", {46.5, -62, 18}},
    {"frontomalare temporale left", {49.5, -61, 34}},
    {"zygion left", {60.5, -32, 0}},
    {"zygomaxillare left", {44.5, -64, -18.5}},
    {"alare left", {12.7, -80, -7}},
    {"mastoidale left", {53, 8, -21}},
    {"asterion left", {59, 45.5, 2}},
    {"gonion left", {38.5, -27, -52}},
};

int run(const char* file) {
  const auto real = read_mesh(file);
  if (!real) {
    fmt::print(stderr, "{}\n", real.error().message());
    return 3;
  }
  ComparisonOptions options;
  options.align = Alignment::similarity;
  options.samples_per_mm2 = 0.5;
  const auto comparison = compare_surfaces(canonical_skull(1.5, 0), *real, options);
  if (!comparison) {
    fmt::print(stderr, "{}\n", comparison.error().message());
    return 5;
  }
  const auto print = [](const char* name, const DistanceStatistics& distances) {
    fmt::print("{}: mean {:.2f}, median {:.2f}, P95 {:.2f} mm\n", name, distances.mean_mm,
               distances.median_mm, distances.p95_mm);
  };
  print("canonical to real, all surfaces", comparison->a_to_b);
  print("real to canonical, all surfaces", comparison->b_to_a);
  double sum = 0.0;
  const auto landmarks = canonical_landmarks();
  for (const Picked& picked : kPicked) {
    const auto found = std::ranges::find(landmarks, picked.name, &Landmark::name);
    const double off = (found->position_mm - Eigen::Vector3d(picked.position_mm)).norm();
    fmt::print("{:30} {:.1f} mm\n", picked.name, off);
    sum += off;
  }
  fmt::print("{} landmarks: mean {:.2f} mm\n", std::size(kPicked), sum / std::size(kPicked));
  return 0;
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: bench_canonical REAL_SKULL.ply\n");
    return 2;
  }
  return skullstation::run(argv[1]);
}
