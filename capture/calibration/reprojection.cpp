#include "capture/calibration/reprojection.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>

namespace skullstation {

bool solve_bundle(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable();
}

Eigen::MatrixXd bundle_covariance(ceres::Problem& problem, const std::vector<double*>& blocks,
                                  Eigen::Index count) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;
  options.apply_loss_function = false;
  ceres::CRSMatrix jacobian;
  if (!problem.Evaluate(options, nullptr, nullptr, nullptr, &jacobian)) return {};
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(jacobian.num_cols, jacobian.num_cols);
  for (int row = 0; row < jacobian.num_rows; ++row) {
    for (int i = jacobian.rows[row]; i < jacobian.rows[row + 1]; ++i) {
      for (int j = jacobian.rows[row]; j < jacobian.rows[row + 1]; ++j) {
        normal(jacobian.cols[i], jacobian.cols[j]) += jacobian.values[i] * jacobian.values[j];
      }
    }
  }
  // The unknowns' units differ by orders of magnitude: a unit diagonal makes rank visible.
  const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt();
  if (!(scale.minCoeff() > 0.0)) return {};
  const Eigen::VectorXd inverse_scale = scale.cwiseInverse();
  const Eigen::MatrixXd scaled = inverse_scale.asDiagonal() * normal * inverse_scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> factor(scaled);
  constexpr double rank_tolerance = 1e-13;
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > rank_tolerance)) return {};
  const Eigen::MatrixXd columns =
      factor.solve(Eigen::MatrixXd::Identity(scaled.rows(), count)).topRows(count);
  return inverse_scale.head(count).asDiagonal() * columns * inverse_scale.head(count).asDiagonal();
}

}  // namespace skullstation
