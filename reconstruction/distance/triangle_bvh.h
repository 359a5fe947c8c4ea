#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// Where on a triangle its closest point lies: at a corner, on an edge (edge i joins corners i and
/// i + 1) or inside.
enum class TriangleFeature { corner0, corner1, corner2, edge0, edge1, edge2, face };

/// The point of a surface that is closest to a query point.
struct ClosestPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double distance_mm = std::numeric_limits<double>::infinity();
  int triangle = -1;  ///< -1 if nothing lies within the search distance
  TriangleFeature feature = TriangleFeature::face;
};

/// Closest point of the triangle a, b, c (Ericson 2005, section 5.1.5); `triangle` is left at -1.
ClosestPoint closest_point_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a,
                                       const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Bounding volume hierarchy over a mesh's triangles for exact closest-point queries in double
/// precision. Built the same from the same mesh always; queries may run on several threads. Among
/// equally close triangles the one that is found first is given, always the same one.
class TriangleBvh {
 public:
  explicit TriangleBvh(const TriangleMesh& mesh);

  /// `triangle` is -1 if no triangle is closer than `max_distance_mm` (or there are none).
  ClosestPoint closest(const Eigen::Vector3d& query,
                       double max_distance_mm = std::numeric_limits<double>::infinity()) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0;  ///< leaf: its first triangle in leaves_; else its second child (first: next)
    int count = 0;  ///< leaf: number of triangles; else 0
  };
  struct Leaf {
    Eigen::Vector3d a, b, c;
    int triangle = 0;
  };

  int build(int begin, int end, std::vector<Eigen::Vector3d>& centroids);

  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
};

}  // namespace skullstation
