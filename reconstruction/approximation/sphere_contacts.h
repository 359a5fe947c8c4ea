#pragma once

#include <optional>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

/// Where a point of the head meets the sphere model.
struct SphereContact {
  Eigen::Index sphere = 0;  ///< the bone's vertex in its middle
  Eigen::Vector3d way;      ///< unit, from there to the point
  double gap_mm = 0.0;      ///< from the sphere's surface to the point; below 0: inside
};

/// Finds, for points of the head, the sphere that reaches nearest to them.
class SphereContacts {
 public:
  /// Spheres stand on those of the bone's vertices that have a radius (not NaN). `bone` has normals
  /// and must outlive this.
  SphereContacts(const TriangleMesh& bone, const Eigen::VectorXd& radius_mm);

  /// Nothing where no sphere comes within 25 mm, or where the way from bone to skin doesn't run
  /// outwards from both.
  /// \param radius_mm of all the bone's vertices, with a number wherever spheres stand
  std::optional<SphereContact> of(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                  const Eigen::VectorXd& radius_mm) const;

 private:
  const TriangleMesh& bone_;
  std::vector<Eigen::Index> spheres_;
  PointTree tree_;
};

}  // namespace skullstation
