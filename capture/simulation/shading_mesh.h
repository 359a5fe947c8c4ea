#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// A specimen's mesh made ready for shading: the same surface, with triangles small enough to
/// carry the ambient light at their corners, linear colours, and normals that are smooth on curved
/// surfaces and sharp at creases.
struct ShadingMesh {
  Points3 vertices;
  Triangles triangles;
  std::vector<Eigen::Vector3f> colors;          ///< per vertex, linear RGB; empty if it has none
  std::vector<Eigen::Vector3f> corner_normals;  ///< 3 per triangle, unit
  std::vector<Eigen::Vector3f> vertex_normals;  ///< per vertex, unit
};

/// Fails (bad_input) for coordinates that are not finite, indices out of range and colours that
/// don't match. Edges longer than `longest_edge_mm` are halved until none is left or the next
/// round would make more than `most_triangles`.
Result<ShadingMesh> make_shading_mesh(const TriangleMesh& mesh, double longest_edge_mm,
                                      int most_triangles);

}  // namespace skullstation
