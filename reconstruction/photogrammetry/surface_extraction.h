#pragma once

#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/fusion_volume.h"

namespace skullstation {

struct FusedSurface {
  TriangleMesh mesh;          ///< with normals
  std::vector<float> weight;  ///< per vertex: of the depths that made it
};

/// The zero surface of the fused distances: marching cubes (Lorensen & Cline 1987) on those cells
/// whose eight corners were all seen, so that the surface ends where nothing was. Oriented; a
/// manifold with boundary. The same bytes for any number of threads.
FusedSurface extract_surface(const FusionVolume& volume, double least_weight, int threads);

}  // namespace skullstation
