#pragma once

#include <Eigen/Core>

#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

using PointFeatures = Eigen::Matrix<float, Eigen::Dynamic, 33, Eigen::RowMajor>;  // #P x 33

/// Fast point feature histograms (Rusu et al. 2009): three angles between normals, 11 bins each,
/// over the points within `radius_mm`, blended with the neighbours' own. Unchanged by rigid motion.
/// `tree` holds the positions of `points`. The same for any number of threads (0: all).
PointFeatures point_features(const OrientedPoints& points, const PointTree& tree, double radius_mm,
                             int threads);

}  // namespace skullstation
