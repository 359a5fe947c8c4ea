#pragma once

#include <Eigen/Core>

#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

/// How strongly a surface bends at each of its points [1/mm]: root mean square of the turn of the
/// normal per distance to the points within `radius_mm` on the same side of the surface. `tree`
/// holds the positions. The same for any number of threads (0: all).
Eigen::VectorXd curvature_measure(const OrientedPoints& points, const PointTree& tree,
                                  double radius_mm, int threads);

/// The value that the given share of the entries exceeds.
double upper_quantile(Eigen::VectorXd values, double share);

}  // namespace skullstation
