#pragma once

#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// Signed distances [mm] of voxel centres from a closed surface, negative inside: exact where they
/// are below `band_mm`, +-band_mm elsewhere. In the grid's order.
struct VoxelDistances {
  double band_mm = 0.0;
  std::vector<float> distance_mm;
};

/// The distances of all voxels of the grid. Sides are told by counting, with their directions, the
/// crossings of the grid's rows with the surface, so that several closed parts may touch or
/// overlap. Deterministic for any number of threads. Fails with `bad_input` for a mesh that
/// is not closed or not turned outward.
Result<VoxelDistances> voxel_distances(const TriangleMesh& mesh, const VoxelGrid& grid,
                                       double band_mm, int threads);

}  // namespace skullstation
