#pragma once

#include <span>
#include <vector>

#include "reconstruction/phantom/shape_measure.h"
#include "reconstruction/phantom/warp_basis.h"

namespace skullstation {

/// What a warp shall give its points.
struct WarpTarget {
  ShapeMeasure measure;
  double value = 0.0;
  double tolerance = 0.01;  ///< SD of the deviation that is as likely as the prior's one SD
};

struct ConditionedWarp {
  Eigen::VectorXd coefficients;
  double worst_deviation = 0.0;  ///< largest of |measured - target|, in the measures' units
  int steps = 0;
};

/// The coefficients nearest to `start` (in the prior's own metric) whose warp gives the points the
/// target measures: w = s + H' (H H' + T)^-1 (target - m(w) + H (w - s)), repeated with H, the
/// measures' derivative, taken anew (Gauss-Newton). With start = 0 that is the most likely
/// deformation with those measures; with a draw of the prior as start it is a draw of what the
/// measures leave open (Matheron's rule, exact for linear measures).
ConditionedWarp condition_warp(const WarpBasis& basis, std::span<const Eigen::Vector3d> points,
                               std::span<const WarpTarget> targets, const Eigen::VectorXd& start);

}  // namespace skullstation
