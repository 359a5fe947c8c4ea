#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// What holds a mesh together.
struct MeshTopology {
  int components = 0;
  std::size_t boundary_edges = 0;        ///< of one triangle
  std::size_t nonmanifold_edges = 0;     ///< of three or more, or run through twice the same way
  std::size_t nonmanifold_vertices = 0;  ///< whose triangles don't form one fan
  long euler_characteristic = 0;         ///< V - E + F, used vertices only

  /// Watertight, oriented, a 2-manifold.
  bool is_closed_manifold() const {
    return components > 0 && boundary_edges == 0 && nonmanifold_edges == 0 &&
           nonmanifold_vertices == 0;
  }
};

MeshTopology topology_of(const TriangleMesh& mesh);

/// For each triangle which of its edges, from corner k to corner k + 1, no other triangle shares.
std::vector<std::array<bool, 3>> boundary_edges(const Triangles& triangles);

/// Which of the `vertices` vertices are an end of such an edge.
std::vector<bool> boundary_vertices(const Triangles& triangles, Eigen::Index vertices);

/// Number of each triangle's connected component (through shared vertices), in the order of the
/// components' first triangles.
std::vector<int> component_of_triangles(const TriangleMesh& mesh);

/// The triangles that `keep` wants, with the vertices that they use, in the old order. Normals and
/// colours go along.
TriangleMesh submesh(const TriangleMesh& mesh, const std::function<bool(Eigen::Index)>& keep);

/// The connected component with the largest area alone.
TriangleMesh largest_component(const TriangleMesh& mesh);

/// Volume that a closed oriented mesh encloses [mm^3]; negative if it is inside out.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace skullstation
