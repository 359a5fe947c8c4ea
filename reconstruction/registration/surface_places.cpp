#include "reconstruction/registration/surface_places.h"

namespace skullstation {

SurfacePlaces::SurfacePlaces(const TriangleMesh& mesh) : mesh_(mesh), bvh_(mesh) {}

SurfacePoint SurfacePlaces::nearest(const Eigen::Vector3d& point) const {
  const ClosestPoint closest = bvh_.closest(point);
  return surface_point(mesh_, closest.triangle, closest.point);
}

}  // namespace skullstation
