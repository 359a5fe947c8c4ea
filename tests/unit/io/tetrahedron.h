#pragma once

#include "core/triangle_mesh.h"

namespace skullstation::testing {

/// The corner of a cube of 10 mm: 4 vertices, 4 triangles, closed.
inline TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 10, 0, 0, 0, 10, 0, 0, 0, 10;
  mesh.triangles.resize(4, 3);
  mesh.triangles << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
  return mesh;
}

}  // namespace skullstation::testing
