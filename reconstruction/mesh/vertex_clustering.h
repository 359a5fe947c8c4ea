#pragma once

#include "core/triangle_mesh.h"

namespace skullstation {

/// One vertex for each cubic cell of `cell_mm` that holds any, in their mean, and the triangles
/// between three cells (Rossignac & Borrel 1993). Quick and lean whatever the mesh; but surfaces
/// nearer to each other than a cell may grow together. Cells are counted from the bounding box's
/// corner and grow where a million of them don't reach across it. Normals and colours are dropped.
/// \pre coordinates are finite, cell_mm > 0
TriangleMesh clustered(const TriangleMesh& mesh, double cell_mm);

/// The mesh itself if it has at most so many triangles, else clustered in cells that leave about so
/// many.
TriangleMesh thinned(TriangleMesh mesh, Eigen::Index most_triangles);

}  // namespace skullstation
