#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// A connected patch of a reconstructed surface where the true one is not: over an opening, between
/// two bones, or floating.
struct Bridge {
  double area_cm2 = 0.0;
  double most_mm = 0.0;  ///< the farthest of it from the truth
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
};

/// The patches of triangles whose middles lie farther than `least_mm` from the truth, largest
/// first.
std::vector<Bridge> find_bridges(const TriangleMesh& surface, const TriangleMesh& truth,
                                 double least_mm, int threads);

}  // namespace skullstation
