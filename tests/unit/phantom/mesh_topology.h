#pragma once

#include "core/triangle_mesh.h"

namespace skullstation {

/// What the connections of a mesh say, whatever its shape.
struct MeshTopology {
  int open_or_crowded_edges = 0;  ///< sides not met exactly once in each direction
  int pinched_vertices = 0;       ///< vertices whose triangles don't form one ring
  int components = 0;
  long euler_characteristic = 0;

  bool closed_oriented_manifold() const {
    return open_or_crowded_edges == 0 && pinched_vertices == 0;
  }
};

MeshTopology topology_of(const TriangleMesh& mesh);

/// Volume [mm^3]; positive for outward orientation.
double enclosed_volume_mm3(const TriangleMesh& mesh);

}  // namespace skullstation
