#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "core/random.h"
#include "core/units.h"
#include "reconstruction/volume/volume.h"

namespace skullstation::testing {

/// A right-handed grid centred at the origin, turned by `angle_deg` about an odd axis.
inline VoxelGrid grid_of(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm,
                         double angle_deg = 0.0) {
  VoxelGrid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.direction = Eigen::AngleAxisd(radians(angle_deg), Eigen::Vector3d(1, 2, -0.5).normalized())
                       .toRotationMatrix();
  const Eigen::Vector3d middle =
      0.5 * (size.cast<double>() - Eigen::Vector3d::Ones()).cwiseProduct(spacing_mm);
  grid.origin_mm = -(grid.direction * middle);
  return grid;
}

/// Samples a field given in patient coordinates.
inline Volume sampled(const VoxelGrid& grid,
                      const std::function<double(const Eigen::Vector3d&)>& hu_at) {
  Volume volume;
  volume.grid = grid;
  volume.hu.resize(grid.count());
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Vector3d point =
            grid.patient_from_voxel(Eigen::Vector3i(i, j, k).cast<double>());
        volume.at(i, j, k) = static_cast<std::int16_t>(std::lround(hu_at(point)));
      }
    }
  }
  return volume;
}

/// Values that differ from voxel to voxel, within what 12 bits hold.
inline Volume noise(const VoxelGrid& grid, std::uint64_t seed) {
  Volume volume;
  volume.grid = grid;
  Random random(seed);
  for (std::size_t i = 0; i < grid.count(); ++i) {
    volume.hu.push_back(static_cast<std::int16_t>(static_cast<int>(random.below(4096)) - 1024));
  }
  return volume;
}

/// Equal but for rounding of the geometry.
inline bool same_place(const VoxelGrid& a, const VoxelGrid& b, double tolerance) {
  return a.size == b.size && (a.spacing_mm - b.spacing_mm).norm() < tolerance &&
         (a.origin_mm - b.origin_mm).norm() < tolerance &&
         (a.direction - b.direction).norm() < tolerance;
}

}  // namespace skullstation::testing
