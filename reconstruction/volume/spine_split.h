#pragma once

#include "reconstruction/volume/spinal_canal.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

/// Takes the vertebrae out of a bone mask. Seeds of the spine are bone round the canal well below
/// the foramen magnum, seeds of the skull the bone above it, in front of it and far to its sides;
/// from both the mask is flooded from the densest bone down (a watershed; Meyer 1994), so that they
/// part where the bone between them is thinnest in density: in the joints. Nothing is taken out
/// where the scan ends above the spine. Returns the number of voxels taken out.
std::size_t remove_spine(const Volume& volume, const SpinalCanal& canal, VoxelMask& bone);

}  // namespace skullstation
