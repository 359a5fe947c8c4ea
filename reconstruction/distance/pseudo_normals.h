#pragma once

#include "core/triangle_mesh.h"
#include "reconstruction/distance/triangle_bvh.h"

namespace skullstation {

/// Normals that tell the inside from the outside at any closest point, on edges and corners too:
/// the angle-weighted pseudo-normals of Baerentzen & Aanaes 2005.
class PseudoNormals {
 public:
  explicit PseudoNormals(const TriangleMesh& mesh);

  /// Not normalised; zero where the triangles have no area.
  Eigen::Vector3d at(const ClosestPoint& closest) const;

  /// The distance with a minus if the query lies behind the surface.
  double signed_distance_mm(const Eigen::Vector3d& query, const ClosestPoint& closest) const;

 private:
  Triangles triangles_;
  Points3 face_normals_;                            ///< #F x 3, unit
  Points3 vertex_normals_;                          ///< #V x 3, weighted by the corners' angles
  Eigen::Matrix<int, Eigen::Dynamic, 3> neighbor_;  ///< across edge i of each triangle; -1: none
};

}  // namespace skullstation
