#pragma once

#include "core/triangle_mesh.h"
#include "reconstruction/phantom/implicit_solid.h"

namespace skullstation {

struct IsosurfaceOptions {
  double cell_mm = 1.0;      ///< edge of a cube of the sampling grid, in [0.2, 20]
  int relaxation_steps = 3;  ///< rounds of evening out the triangles along the surface, 0 or more
  int threads = 0;           ///< 0: all
};

/// The zero surface of a solid as a closed, oriented manifold: marching cubes (Lorensen & Cline
/// 1987) on the part of a grid near the surface, with the ambiguous faces decided alike from both
/// sides, so that no hole opens; then the vertices slide along the surface towards the middle of
/// their neighbours. Grid planes lie at whole multiples of the cell, so a solid symmetric in x = 0
/// gives a symmetric mesh up to the diagonals. Vertices come with the solid's normals. The same
/// bytes for any number of threads.
/// \pre the options lie in their ranges
TriangleMesh isosurface(const ImplicitSolid& solid, const IsosurfaceOptions& options);

}  // namespace skullstation
