#include "reconstruction/registration/surface_point.h"

#include <Eigen/Geometry>

namespace skullstation {

SurfacePoint surface_point(const TriangleMesh& mesh, int triangle, const Eigen::Vector3d& point) {
  SurfacePoint place;
  place.corners = mesh.triangles.row(triangle);
  const Eigen::Vector3d a = mesh.vertices.row(place.corners[0]);
  const Eigen::Vector3d ab = mesh.vertices.row(place.corners[1]).transpose() - a;
  const Eigen::Vector3d ac = mesh.vertices.row(place.corners[2]).transpose() - a;
  const Eigen::Vector3d ap = point - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double squared = normal.squaredNorm();
  if (squared == 0.0) return place;
  const double v = ap.cross(ac).dot(normal) / squared;
  const double w = ab.cross(ap).dot(normal) / squared;
  place.weights = {1.0 - v - w, v, w};
  return place;
}

Points3 landmark_positions(const std::vector<TemplateLandmark>& landmarks,
                           const Points3& vertices) {
  Points3 positions(static_cast<Eigen::Index>(landmarks.size()), 3);
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    positions.row(i) = landmarks[static_cast<std::size_t>(i)].place.position(vertices).transpose();
  }
  return positions;
}

}  // namespace skullstation
