#pragma once

#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/surface_point.h"

namespace skullstation {

/// The place of a fitted head that is nearest to a point.
struct SheetHit {
  SurfacePoint place;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double distance_mm = 0.0;
  bool beyond_edge = false;  ///< nearest to the sheet's end: the scan goes on where it doesn't
};

/// The template's surface as it lies now, for searches.
class HeadSheet {
 public:
  /// `rim`: which vertices are on the sheet's end, at the neck. Both must live on.
  HeadSheet(const HeadTemplate& head, const Points3& vertices, const std::vector<bool>& rim);

  SheetHit nearest(const Eigen::Vector3d& query) const;

 private:
  TriangleMesh mesh_;
  TriangleBvh bvh_;
  const std::vector<bool>& rim_;
};

}  // namespace skullstation
