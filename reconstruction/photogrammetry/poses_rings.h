#pragma once

#include <optional>
#include <vector>

#include "reconstruction/photogrammetry/bundle_adjustment.h"

namespace skullstation {

/// What the station tells about a view's place in it.
struct RingMembership {
  int camera = 0;
  int pass = 0;
  std::optional<double> table_angle_deg;  ///< as commanded
};

/// Start values of axes, rings and angles from the views' own poses: a pass whose board turned
/// between two views of one camera by 5 deg or more gets an axis, each of its cameras a ring.
/// Fills `problem.axes`, `problem.rings` and the views' `ring`, `angle_rad` and `commanded_rad`
/// (negative angles where the table turns the other way). Returns the pass of each axis.
std::vector<int> begin_rings(BundleProblem& problem, const std::vector<RingMembership>& members);

/// Turns each ring's zero so that the median difference between its angles and the commanded ones
/// is nil: single stops where the table slipped have no say in where zero is.
void level_rings(BundleProblem& problem);

/// How far rings are to be believed: as far as the free poses keep to them, their noise taken out.
/// `covariances`: of each view's pose (see BundleCovariance).
TableTrust trust_in_rings(const BundleProblem& problem,
                          const std::vector<Eigen::Matrix<double, 6, 6>>& covariances,
                          double reach_mm, double least_departure_mm);

}  // namespace skullstation
