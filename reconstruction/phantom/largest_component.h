#pragma once

#include "core/triangle_mesh.h"

namespace skullstation {

/// The connected part of the mesh with the most vertices (of equals the first), its vertices and
/// triangles in their order.
TriangleMesh largest_component(const TriangleMesh& mesh);

}  // namespace skullstation
