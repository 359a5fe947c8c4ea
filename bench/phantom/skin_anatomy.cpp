// How deep the canonical skin lies over the skull beside the tissue depth table; and either how far
// it and its landmarks lie from a real head's, or how long the CT of the canonical head takes, and
// how well its isosurfaces, and what CT import makes of it, meet the exact surfaces.
//
//   bench_skin_anatomy [--real SKIN.ply]     the real head's skin (ct import ct-head.nii.gz)

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "reconstruction/distance/comparison.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/phantom_ct.h"
#include "reconstruction/phantom/thickness_table.h"
#include "reconstruction/volume/ct_surfaces.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

Vector3d at(const std::vector<Landmark>& landmarks, const std::string& name) {
  return std::ranges::find(landmarks, name, &Landmark::name)->position_mm;
}

void print_depths(const TriangleMesh& skin) {
  const std::vector<Landmark> bones = canonical_landmarks();
  const std::vector<Landmark> skins = canonical_skin_landmarks();
  const TriangleBvh surface(skin);
  fmt::print("{:24} {:>8} {:>8} {:>8}   mm\n", "tissue depth", "table", "probed", "closest");
  for (const TissueThickness& depth : thickness_table()) {
    const std::string side = depth.bilateral ? " left" : "";
    const Vector3d bone = at(bones, std::string(depth.bone) + side);
    const double probed = (at(skins, std::string(depth.bone) + " skin" + side) - bone).norm();
    fmt::print("{:24} {:8.1f} {:8.1f} {:8.1f}\n", depth.bone, depth.mean_mm, probed,
               surface.closest(bone).distance_mm);
  }
}

/// Read off orthographic pictures of the real head's skin (patient frame of the scan) with a grid
/// of 10 mm; to about 2 mm. What metal streaks or flatness blur (mouth, vertex, opisthocranion) is
/// left out.
struct Picked {
  std::string_view name;
  double position_mm[3];
};

constexpr Picked kPicked[] = {
    {"pronasale", {106.5, 8.1, 108.6}},          {"subnasale", {106.0, 25.4, 92.9}},
    {"nasion skin", {107.0, 39.5, 143.5}},       {"glabella skin", {106.4, 47.0, 163.5}},
    {"alare left", {124.4, 28.5, 100.0}},        {"alare right", {92.3, 28.5, 100.0}},
    {"endocanthion left", {127.4, 52.8, 133.1}}, {"exocanthion left", {148.0, 60.5, 132.6}},
    {"exocanthion right", {66.4, 58.7, 135.4}},  {"superaurale left", {188.5, 150.0, 118.0}},
    {"superaurale right", {17.5, 150.0, 123.3}}, {"subaurale left", {183.0, 137.2, 65.8}},
    {"subaurale right", {32.0, 132.2, 65.8}},    {"tragion left", {180.4, 132.8, 97.0}},
    {"tragion right", {28.6, 127.8, 99.5}},      {"pogonion skin", {106.4, 29.8, 41.5}},
    {"menton skin", {106.4, 38.6, 21.5}},
};

void print_landmarks(const Similarity3& real_from_canonical) {
  const std::vector<Landmark> landmarks = canonical_skin_landmarks();
  double sum_mm = 0.0;
  for (const Picked& picked : kPicked) {
    const Vector3d real(picked.position_mm);
    const Vector3d off_mm = real_from_canonical * at(landmarks, std::string(picked.name)) - real;
    fmt::print("{:24} {:5.1f} mm ({:.1f} left, {:.1f} back, {:.1f} up)\n", picked.name,
               off_mm.norm(), off_mm.x(), off_mm.y(), off_mm.z());
    sum_mm += off_mm.norm();
  }
  fmt::print("{} landmarks: mean {:.2f} mm (at most 4)\n", std::size(kPicked),
             sum_mm / std::size(kPicked));
}

int print_real(const TriangleMesh& skin, const char* path) {
  const auto real = read_mesh(path);
  if (!real) {
    fmt::print("{}\n", real.error().message());
    return 3;
  }
  ComparisonOptions options;
  options.align = Alignment::similarity;
  options.samples_per_mm2 = 0.2;
  // The head without the neck: above a plane that falls from the nape to the chin.
  for (Eigen::Index v = 0; v < skin.vertices.rows(); ++v) {
    const double back_mm = std::max(skin.vertices(v, 1) + 60.0, 0.0);
    options.region.push_back(skin.vertices(v, 2) > -85.0 + 0.35 * back_mm);
  }
  const auto comparison = compare_surfaces(skin, *real, options);
  if (!comparison) {
    fmt::print("{}\n", comparison.error().message());
    return 5;
  }
  const DistanceStatistics& d = comparison->a_to_b;
  fmt::print("\nfrom the real head: mean {:.2f}, median {:.2f}, P95 {:.2f} mm (scale {:.3f})\n",
             d.mean_mm, d.median_mm, d.p95_mm, comparison->b_from_a.scale);
  print_landmarks(comparison->b_from_a);
  return 0;
}

double value_at(const Volume& volume, const Vector3d& patient) {
  const Vector3d voxel = volume.grid.voxel_from_patient(patient);
  const Eigen::Vector3i cell = voxel.array().floor().cast<int>();
  const Vector3d part = voxel - cell.cast<double>();
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i step(corner & 1, corner >> 1 & 1, corner >> 2);
    double weight = 1.0;
    for (int k = 0; k < 3; ++k) weight *= step[k] == 1 ? part[k] : 1.0 - part[k];
    sum += weight * volume.at(cell.x() + step.x(), cell.y() + step.y(), cell.z() + step.z());
  }
  return sum;
}

/// Along the normals of the exact surface: how far off the volume passes through `iso_hu`.
void print_isosurface(const char* name, const Volume& volume, const TriangleMesh& mesh,
                      double iso_hu) {
  constexpr double kReach_mm = 2.0;
  constexpr double kStep_mm = 0.05;
  std::vector<double> offsets;
  int without = 0;
  double sum = 0.0;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); v += 7) {
    const Vector3d p = mesh.vertices.row(v);
    const Vector3d n = mesh.normals.row(v);
    double nearest = kReach_mm;
    for (double t = -kReach_mm; t < kReach_mm; t += kStep_mm) {
      const double here = value_at(volume, p + t * n) - iso_hu;
      const double there = value_at(volume, p + (t + kStep_mm) * n) - iso_hu;
      if (here < 0.0 || there >= 0.0) continue;
      const double crossing = t + kStep_mm * here / (here - there);
      if (std::abs(crossing) < std::abs(nearest)) nearest = crossing;
    }
    if (nearest == kReach_mm) {
      ++without;
      continue;
    }
    offsets.push_back(std::abs(nearest));
    sum += nearest;
  }
  std::ranges::sort(offsets);
  const auto count = static_cast<double>(offsets.size());
  double mean = 0.0;
  for (const double offset : offsets) mean += offset / count;
  fmt::print(
      "{} at {:.0f} HU: mean {:.3f}, signed {:+.3f}, P95 {:.3f} mm, none within 2 mm {:.2f} %\n",
      name, iso_hu, mean, sum / count, offsets[static_cast<std::size_t>(0.95 * count)],
      100.0 * without / (without + count));
}

void print_import(const char* name, const TriangleMesh& exact, const TriangleMesh& imported,
                  double lowest_z_mm) {
  ComparisonOptions options;
  options.samples_per_mm2 = 0.5;
  for (Eigen::Index v = 0; v < exact.vertices.rows(); ++v) {
    options.region.push_back(exact.vertices(v, 2) > lowest_z_mm);
  }
  const auto comparison = compare_surfaces(exact, imported, options);
  if (!comparison) {
    fmt::print("{}: {}\n", name, comparison.error().message());
    return;
  }
  const auto& d = comparison->a_to_b;
  const auto& back = comparison->b_to_a;
  fmt::print(
      "imported {}: mean {:.3f} and back {:.3f} mm (at most 0.15), P95 {:.3f} and {:.3f} mm "
      "(at most 0.5)\n",
      name, d.mean_mm, back.mean_mm, d.p95_mm, back.p95_mm);
}

int run(int argc, char** argv) {
  const TriangleMesh skin = canonical_skin(1.5, 0);
  print_depths(skin);
  if (argc == 3 && std::strcmp(argv[1], "--real") == 0) {
    return print_real(skin, argv[2]);
  }
  PhantomBody body;
  body.bone = canonical_skull(1.0, 0);
  body.skin = skin;
  body.canonical_from_patient = [](const Vector3d& p) { return CanonicalPlace{p, p}; };
  const TissueMap tissue(0);
  const auto start = std::chrono::steady_clock::now();
  const auto volume = phantom_ct(body, tissue, {});
  if (!volume) {
    fmt::print("{}\n", volume.error().message());
    return 5;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const Eigen::Vector3i size = volume->grid.size;
  fmt::print("\nCT of {} x {} x {} voxels of 0.5 x 0.5 x 1 mm: {:.1f} s (at most 60)\n", size.x(),
             size.y(), size.z(), took.count());
  print_isosurface("skin", *volume, body.skin, -200.0);
  print_isosurface("bone", *volume, body.bone, 600.0);
  const auto surfaces = extract_ct_surfaces(*volume, {});
  if (!surfaces) {
    fmt::print("{}\n", surfaces.error().message());
    return 5;
  }
  // Away from the cut under the mandible.
  constexpr double kCropMargin_mm = 5.0;
  const double low_mm = surfaces->quality.crop_z_mm.value_or(-200.0) + kCropMargin_mm;
  print_import("skin", body.skin, surfaces->skin, low_mm);
  print_import("bone", body.bone, surfaces->skull, -200.0);
  return 0;
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) { return skullstation::run(argc, argv); }
