#pragma once

#include <span>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// Which vertices lie on the outside: seen from far away in at least 8 % of the directions of their
/// half space, weighted by the cosine. The inner surfaces of a skull see the outside only through
/// its openings. \pre the mesh has normals
std::vector<bool> outside_vertices(const TriangleMesh& mesh, int threads);

/// The same of some vertices alone, along fewer of the `directions` over the whole sphere.
std::vector<bool> outside_vertices(const TriangleMesh& mesh, std::span<const int> vertices,
                                   int directions, int threads);

}  // namespace skullstation
