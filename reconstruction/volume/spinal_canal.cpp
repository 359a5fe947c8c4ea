#include "reconstruction/volume/spinal_canal.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/volume/morphology.h"

namespace skullstation {

namespace {

constexpr int soft_tissue_from_hu = -150;
constexpr int bone_from_hu = 300;  // in block means; thin bone blurs
constexpr double core_radius_mm = 16.0;
constexpr double least_core_mm3 = 5e4;
/// A ball of the core's radius comes to rest this far above a foramen of 15 mm radius.
constexpr double rest_above_foramen_mm = 6.0;
constexpr double widest_step_mm = 6.0;
constexpr double narrowest_canal_mm = 3.5;

/// Soft tissue of the head.
VoxelMask soft_tissue(const CoarseVolume& coarse, const HeadVoxels& head) {
  VoxelMask soft(coarse.grid.size);
  for (std::size_t v = 0; v < soft.on.size(); ++v) {
    soft.on[v] =
        head.head.on[v] != 0 && coarse.hu[v] >= soft_tissue_from_hu && coarse.hu[v] < bone_from_hu
            ? 1
            : 0;
  }
  return soft;
}

/// The place within `step_mm` of `middle` in slice k that is farthest from bone.
std::pair<Eigen::Vector3d, double> widest_place(const std::vector<float>& from_bone_mm2,
                                                const VoxelGrid& grid,
                                                const Eigen::Vector3d& middle, int k) {
  std::pair<Eigen::Vector3d, double> best{middle, -1.0};
  for (int j = 0; j < grid.size.y(); ++j) {
    for (int i = 0; i < grid.size.x(); ++i) {
      const Eigen::Vector3d place = Eigen::Vector3d(i, j, k).cwiseProduct(grid.spacing_mm);
      const double aside_mm = (place - middle).head<2>().norm();
      if (aside_mm > widest_step_mm) continue;
      // A small pull to the straight way on keeps it in the canal where that is open at the side.
      const double width_mm = std::sqrt(from_bone_mm2[grid.index(i, j, k)]) - 0.2 * aside_mm;
      if (width_mm > best.second) best = {place, width_mm};
    }
  }
  return best;
}

}  // namespace

Eigen::Vector3d SpinalCanal::middle_at(double z_mm) const {
  Eigen::Vector3d nearest = foramen_magnum_mm;
  for (const Eigen::Vector3d& middle : middle_mm) {
    if (std::abs(middle.z() - z_mm) < std::abs(nearest.z() - z_mm)) nearest = middle;
  }
  return nearest;
}

Eigen::Vector3d SpinalCanal::up() const {
  const Eigen::Vector3d below = middle_at(foramen_magnum_mm.z() - 30.0);
  const Eigen::Vector3d along = foramen_magnum_mm - below;
  return along.z() < 10.0 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(along.normalized());
}

std::optional<SpinalCanal> find_spinal_canal(const CoarseVolume& coarse, const HeadVoxels& head,
                                             int threads) {
  const VoxelGrid& grid = coarse.grid;
  const VoxelComponents cores(
      eroded(soft_tissue(coarse, head), core_radius_mm, grid.spacing_mm, threads),
      Connectivity::face6);
  const int brain = cores.largest();
  if (brain < 0) return std::nullopt;
  const auto& core = cores.all()[static_cast<std::size_t>(brain)];
  SpinalCanal canal;
  canal.brain_mm3 = static_cast<double>(core.voxels) * grid.spacing_mm.prod();
  if (canal.brain_mm3 < least_core_mm3) return std::nullopt;

  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();
  double count = 0.0;
  const int low_slices = 1 + static_cast<int>(3.0 / grid.spacing_mm.z());
  cores.for_each_run([&](const VoxelRun& run, int j, int k) {
    if (run.component != brain || k >= core.least.z() + low_slices) return;
    for (int i = run.begin; i < run.end; ++i) {
      lowest += Eigen::Vector3d(i, j, k).cwiseProduct(grid.spacing_mm);
      count += 1.0;
    }
  });
  lowest /= count;
  canal.foramen_magnum_mm = lowest - Eigen::Vector3d(0.0, 0.0, rest_above_foramen_mm);

  const auto from_bone_mm2 =
      squared_distance_mm2(coarse.at_least(bone_from_hu), grid.spacing_mm, threads);
  Eigen::Vector3d middle = lowest;
  for (int k = core.least.z() - 1; k >= 0; --k) {
    const auto [place, width_mm] = widest_place(from_bone_mm2, grid, middle, k);
    if (width_mm < narrowest_canal_mm) break;
    middle = place;
    canal.middle_mm.push_back(middle);
  }
  return canal;
}

}  // namespace skullstation
