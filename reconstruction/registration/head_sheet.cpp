#include "reconstruction/registration/head_sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace skullstation {

HeadSheet::HeadSheet(const HeadTemplate& head, const Points3& vertices,
                     const std::vector<bool>& rim)
    : mesh_(surface_of(head, vertices)), bvh_(mesh_), rim_(rim) {}

SheetHit HeadSheet::nearest(const Eigen::Vector3d& query) const {
  const ClosestPoint closest = bvh_.closest(query);
  SheetHit hit;
  hit.place = surface_point(mesh_, closest.triangle, closest.point);
  const auto corner = [&](int i) -> Eigen::Vector3d {
    return mesh_.vertices.row(hit.place.corners[i]);
  };
  const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  if (normal.squaredNorm() > 0.0) hit.normal = normal.normalized();
  hit.point = closest.point;
  hit.distance_mm = closest.distance_mm;
  for (int i = 0; i < 3; ++i) {
    // Off the sheet's end the nearest point lies on its rim.
    hit.beyond_edge = hit.beyond_edge || (rim_[static_cast<std::size_t>(hit.place.corners[i])] &&
                                          hit.place.weights[i] > 0.999);
    const int j = (i + 1) % 3;
    hit.beyond_edge = hit.beyond_edge || (rim_[static_cast<std::size_t>(hit.place.corners[i])] &&
                                          rim_[static_cast<std::size_t>(hit.place.corners[j])] &&
                                          hit.place.weights[3 - i - j] < 1e-3);
  }
  return hit;
}

}  // namespace skullstation
