#include "reconstruction/volume/head_region.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/volume/morphology.h"
#include "reconstruction/volume/opening_seal.h"

namespace skullstation {

namespace {

constexpr double core_radius_mm = 6.0;
constexpr double farthest_thin_part_mm = 30.0;
constexpr double largest_thin_part_mm3 = 60000.0;  // an ear has about 10 ml
constexpr double widest_opening_mm = 16.0;         // nostril, lips of a slightly open mouth
constexpr double least_share_of_a_wall = 0.8;
constexpr double least_head_mm3 = 5e5;

double voxel_mm3(const CoarseVolume& coarse) { return coarse.grid.spacing_mm.prod(); }

/// Tissue without its inner air.
VoxelMask filled(const VoxelMask& tissue) { return inverted(reachable_from_outside(tissue)); }

/// The largest body of `solid` that is more than twice `core_radius_mm` thick, grown back to its
/// surface and a voxel beyond.
Result<VoxelMask> thick_body(const CoarseVolume& coarse, const VoxelMask& solid, int threads) {
  const Eigen::Vector3d& spacing_mm = coarse.grid.spacing_mm;
  const VoxelComponents cores(eroded(solid, core_radius_mm, spacing_mm, threads),
                              Connectivity::face6);
  const int largest = cores.largest();
  if (largest < 0 || static_cast<double>(cores.all()[static_cast<std::size_t>(largest)].voxels) *
                             voxel_mm3(coarse) <
                         least_head_mm3) {
    return fail(ErrorKind::no_result, "CT volume", "holds no head",
                "check that it is a head scan in Hounsfield units");
  }
  std::vector<bool> keep(cores.all().size(), false);
  keep[static_cast<std::size_t>(largest)] = true;
  return dilated(cores.mask_of(keep), core_radius_mm + 1.1 * spacing_mm.maxCoeff(), spacing_mm,
                 threads);
}

/// Counts the faces between head and removed voxels.
void measure_contact(const CoarseVolume& coarse, HeadVoxels& region) {
  const Eigen::Vector3i size = region.head.size;
  const Eigen::Vector3d& spacing_mm = coarse.grid.spacing_mm;
  double middle_j = 0.0;
  double count = 0.0;
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) {
        if (!region.head.at(i, j, k)) continue;
        middle_j += j;
        count += 1.0;
      }
    }
  }
  middle_j /= std::max(1.0, count);
  const auto add = [&](bool a, bool b, int j, double area_mm2) {
    if (a && b) (j < middle_j ? region.contact_front_mm2 : region.contact_back_mm2) += area_mm2;
  };
  const Eigen::Vector3d face_mm2(spacing_mm.y() * spacing_mm.z(), spacing_mm.x() * spacing_mm.z(),
                                 spacing_mm.x() * spacing_mm.y());
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) {
        const bool head = region.head.at(i, j, k);
        const bool removed = region.removed.at(i, j, k);
        if (!head && !removed) continue;
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3i next(i, j, k);
          if (++next[axis] == size[axis]) continue;
          add(head, region.removed.at(next.x(), next.y(), next.z()), j, face_mm2[axis]);
          add(removed, region.head.at(next.x(), next.y(), next.z()), j, face_mm2[axis]);
        }
      }
    }
  }
}

}  // namespace

Result<HeadVoxels> find_head(const CoarseVolume& coarse, int tissue_hu, int threads) {
  const VoxelMask tissue = coarse.at_least(tissue_hu);
  const auto body = thick_body(coarse, filled(tissue), threads);
  if (!body) return forward(body);
  // With nostrils and mouth closed the nose is thick too.
  const auto closed_body = thick_body(
      coarse, filled_behind_openings(tissue, coarse.grid.spacing_mm, widest_opening_mm, threads),
      threads);
  if (!closed_body) return forward(closed_body);
  const auto from_body_mm2 = squared_distance_mm2(*body, coarse.grid.spacing_mm, threads);

  VoxelMask thin(tissue.size);
  for (std::size_t v = 0; v < thin.on.size(); ++v) thin.on[v] = tissue.on[v] & ~body->on[v] & 1;
  const VoxelComponents parts(thin, Connectivity::corner26);
  std::vector<double> reach_mm2(parts.all().size(), 0.0);
  std::vector<std::size_t> in_closed_body(parts.all().size(), 0);
  std::vector<bool> touches(parts.all().size(), false);
  const double touch_mm = 1.01 * coarse.grid.spacing_mm.norm();
  parts.for_each_run([&](const VoxelRun& run, int j, int k) {
    const auto part = static_cast<std::size_t>(run.component);
    for (int i = run.begin; i < run.end; ++i) {
      const double distance = from_body_mm2[thin.index(i, j, k)];
      reach_mm2[part] = std::max(reach_mm2[part], distance);
      if (distance <= touch_mm * touch_mm) touches[part] = true;
      in_closed_body[part] += closed_body->on[thin.index(i, j, k)];
    }
  });
  std::vector<bool> belongs(parts.all().size(), false);
  for (std::size_t part = 0; part < belongs.size(); ++part) {
    const double volume_mm3 = static_cast<double>(parts.all()[part].voxels) * voxel_mm3(coarse);
    const bool small =
        std::sqrt(reach_mm2[part]) <= farthest_thin_part_mm && volume_mm3 <= largest_thin_part_mm3;
    const bool wall = static_cast<double>(in_closed_body[part]) >=
                      least_share_of_a_wall * static_cast<double>(parts.all()[part].voxels);
    belongs[part] = touches[part] && (small || wall);
  }
  HeadVoxels region{parts.mask_of(belongs), VoxelMask(tissue.size)};
  for (std::size_t v = 0; v < tissue.on.size(); ++v) {
    if (tissue.on[v] == 0) continue;
    if (body->on[v] != 0) region.head.on[v] = 1;
    region.removed.on[v] = region.head.on[v] == 0 ? 1 : 0;
    region.removed_mm3 += region.removed.on[v] * voxel_mm3(coarse);
  }
  measure_contact(coarse, region);
  return region;
}

}  // namespace skullstation
