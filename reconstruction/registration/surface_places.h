#pragma once

#include "core/triangle_mesh.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/registration/surface_point.h"

namespace skullstation {

/// Finds places on a surface that move with it.
class SurfacePlaces {
 public:
  explicit SurfacePlaces(const TriangleMesh& mesh);

  /// The place nearest to a point.
  SurfacePoint nearest(const Eigen::Vector3d& point) const;

 private:
  TriangleMesh mesh_;
  TriangleBvh bvh_;
};

}  // namespace skullstation
