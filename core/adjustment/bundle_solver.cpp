#include "core/adjustment/bundle_solver.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>

namespace skullstation {

bool solve_bundle(ceres::Problem& problem, BundleShape shape) {
  ceres::Solver::Options options;
  double tolerance = 0.0;
  switch (shape) {
    case BundleShape::few_unknowns:
      options.linear_solver_type = ceres::DENSE_SCHUR;
      tolerance = 1e-12;
      break;
    case BundleShape::many_views:
      options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
      tolerance = 1e-10;
      break;
    case BundleShape::many_points:
      options.linear_solver_type = ceres::SPARSE_SCHUR;
      tolerance = 1e-6;
      break;
  }
  options.max_num_iterations = 200;
  options.function_tolerance = tolerance;
  options.parameter_tolerance = tolerance;
  options.gradient_tolerance = 1e-12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable();
}

Eigen::MatrixXd bundle_covariance(ceres::Problem& problem, const std::vector<double*>& blocks,
                                  Eigen::Index count, bool robust) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;
  options.apply_loss_function = robust;
  ceres::CRSMatrix jacobian;
  if (!problem.Evaluate(options, nullptr, nullptr, nullptr, &jacobian)) return {};
  if (count < 0) count = jacobian.num_cols;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(jacobian.num_cols, jacobian.num_cols);
  for (int row = 0; row < jacobian.num_rows; ++row) {
    const auto begin = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row)]);
    const auto end = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row) + 1]);
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t j = begin; j < end; ++j) {
        normal(jacobian.cols[i], jacobian.cols[j]) += jacobian.values[i] * jacobian.values[j];
      }
    }
  }
  // The unknowns' units differ by orders of magnitude: a unit diagonal makes rank visible.
  if (!(normal.diagonal().minCoeff() > 0.0)) return {};
  const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> factor(scaled);
  constexpr double rank_tolerance = 1e-13;
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > rank_tolerance)) return {};
  const Eigen::MatrixXd columns =
      factor.solve(Eigen::MatrixXd::Identity(scaled.rows(), count)).topRows(count);
  return scale.head(count).asDiagonal() * columns * scale.head(count).asDiagonal();
}

}  // namespace skullstation
