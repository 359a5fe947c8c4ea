#pragma once

#include <cstdint>
#include <span>

#include "core/triangle_mesh.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// The surface where a field passes through `iso_hu`, in patient coordinates [mm],
/// counter-clockwise seen from the lower side: marching cubes (Lorensen & Cline 1987) with vertices
/// interpolated linearly on the grid's edges. On faces whose diagonals disagree, the corners above
/// the threshold are joined, always; so the surface is a closed oriented 2-manifold, and its
/// components are those of the voxels above the threshold under 18-connectivity. What lies outside
/// the grid counts as far below: a body that is cut by the grid's border gets a flat cap in the
/// plane of the border's voxels. Deterministic for any number of threads.
///
/// @pre values.size() == grid.count(), iso_hu above -32768
TriangleMesh isosurface(const VoxelGrid& grid, std::span<const std::int16_t> values, double iso_hu,
                        int threads);

}  // namespace skullstation
