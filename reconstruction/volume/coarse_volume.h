#pragma once

#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

/// A volume of block means, for questions of anatomy that need no fine detail.
struct CoarseVolume {
  VoxelGrid grid;
  std::vector<std::int16_t> hu;
  Eigen::Vector3i block = Eigen::Vector3i::Ones();  ///< fine voxels per coarse one along i, j, k

  /// Coarse voxel of a fine one.
  Eigen::Vector3i from_fine(int i, int j, int k) const {
    return {i / block.x(), j / block.y(), k / block.z()};
  }
  VoxelMask at_least(int hu_threshold) const;
};

/// Means over blocks that measure about `voxel_mm` each way; those at the far borders are smaller.
CoarseVolume coarse_volume(const Volume& volume, double voxel_mm, int threads);

}  // namespace skullstation
