#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

/// Squared distance [mm^2] from each voxel's centre to the nearest voxel that is on (0 for those
/// that are on themselves; infinite if there is none): exact Euclidean distance transform
/// (Felzenszwalb & Huttenlocher 2012) on an anisotropic grid.
std::vector<float> squared_distance_mm2(const VoxelMask& mask, const Eigen::Vector3d& spacing_mm,
                                        int threads);

/// Voxels within `radius_mm` of one that is on.
VoxelMask dilated(const VoxelMask& mask, double radius_mm, const Eigen::Vector3d& spacing_mm,
                  int threads);

/// Voxels farther than `radius_mm` from every one that is off; what lies beyond the grid counts as
/// on.
VoxelMask eroded(const VoxelMask& mask, double radius_mm, const Eigen::Vector3d& spacing_mm,
                 int threads);

/// Every voxel that is off becomes on, and the other way round.
VoxelMask inverted(VoxelMask mask);

/// Voxels that are off and can be reached from the grid's border through such voxels, face by face.
/// From the lowest slice (k = 0), which usually cuts through the neck, the way begins at its own
/// border only.
VoxelMask reachable_from_outside(const VoxelMask& mask);

}  // namespace skullstation
