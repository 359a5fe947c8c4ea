#include "reconstruction/templates/surface_places.h"

#include <Eigen/Geometry>

namespace skullstation {

SurfacePlaces::SurfacePlaces(const TriangleMesh& mesh) : mesh_(mesh), bvh_(mesh) {}

SurfacePoint SurfacePlaces::nearest(const Eigen::Vector3d& point) const {
  const ClosestPoint closest = bvh_.closest(point);
  SurfacePoint place;
  place.corners = mesh_.triangles.row(closest.triangle);
  const Eigen::Vector3d a = mesh_.vertices.row(place.corners[0]);
  const Eigen::Vector3d ab = mesh_.vertices.row(place.corners[1]).transpose() - a;
  const Eigen::Vector3d ac = mesh_.vertices.row(place.corners[2]).transpose() - a;
  const Eigen::Vector3d ap = closest.point - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double squared = normal.squaredNorm();
  if (squared == 0.0) return place;
  const double v = ap.cross(ac).dot(normal) / squared;
  const double w = ab.cross(ap).dot(normal) / squared;
  place.weights = {1.0 - v - w, v, w};
  return place;
}

}  // namespace skullstation
