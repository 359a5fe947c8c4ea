#pragma once

#include <Eigen/Core>
#include <vector>

namespace ceres {
class Problem;
}

namespace skullstation {

/// How the normal equations are solved: many blocks that see few others are sparse, points that
/// share no residual are eliminated first.
enum class BundleShape { few_unknowns, many_views, many_points };

/// Solves the problem to convergence on one thread, so that the result is the same everywhere.
/// False if no usable solution was found.
bool solve_bundle(ceres::Problem& problem, BundleShape shape = BundleShape::few_unknowns);

/// Covariance of the first `count` entries of the listed parameter blocks (tangent space, in the
/// order of the list; a count below 0 means all) from the normal equations' inverse, for residuals
/// of unit variance; `robust`: each residual weighs what its loss leaves of it. Empty if some
/// unknown is not determined. The list names all blocks that are free.
Eigen::MatrixXd bundle_covariance(ceres::Problem& problem, const std::vector<double*>& blocks,
                                  Eigen::Index count, bool robust = false);

}  // namespace skullstation
