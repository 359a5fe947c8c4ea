#pragma once

#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

/// The field whose isosurface at `bone_hu` bounds the skull's voxels: the scan's own values, but
/// other bone is lowered below the threshold, and cavities that no way leads into from outside
/// (diploe) are raised above it.
std::vector<std::int16_t> skull_field(const Volume& volume, const VoxelMask& skull, int bone_hu,
                                      int threads);

}  // namespace skullstation
