#include "reconstruction/phantom/warp_conditioning.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace skullstation {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

ConditionedWarp condition_warp(const WarpBasis& basis, std::span<const Vector3d> points,
                               std::span<const WarpTarget> targets, const VectorXd& start) {
  std::vector<Eigen::Matrix3Xd> displacements;
  displacements.reserve(points.size());
  for (const Vector3d& point : points) displacements.push_back(basis.displacements(point));
  std::vector<Vector3d> moved(points.size());
  const auto move = [&](const VectorXd& coefficients) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      moved[i] = points[i] + displacements[i] * coefficients;
    }
  };
  const auto count = static_cast<Eigen::Index>(targets.size());
  VectorXd deviation(count);
  const auto deviate = [&] {
    for (Eigen::Index t = 0; t < count; ++t) {
      deviation[t] = targets[t].value - measured(targets[t].measure, moved);
    }
  };

  // What the steps make less: twice the negative log of prior times likelihood.
  const auto cost = [&](const VectorXd& coefficients) {
    move(coefficients);
    deviate();
    double sum = (coefficients - start).squaredNorm();
    for (Eigen::Index t = 0; t < count; ++t) {
      const double miss = deviation[t] / targets[t].tolerance;
      sum += miss * miss;
    }
    return sum;
  };

  ConditionedWarp result;
  result.coefficients = start;
  constexpr int kMostSteps = 30;
  double least = cost(start);
  for (result.steps = 0; result.steps < kMostSteps; ++result.steps) {
    MatrixXd slope = MatrixXd::Zero(count, basis.size());
    for (Eigen::Index t = 0; t < count; ++t) {
      const ShapeMeasure& measure = targets[t].measure;
      const Eigen::Matrix3Xd gradient = measure_gradient(measure, moved);
      for (std::size_t p = 0; p < measure.points.size(); ++p) {
        slope.row(t) += gradient.col(static_cast<Eigen::Index>(p)).transpose() *
                        displacements[measure.points[p]];
      }
    }
    MatrixXd spread = slope * slope.transpose();
    for (Eigen::Index t = 0; t < count; ++t) {
      spread(t, t) += targets[t].tolerance * targets[t].tolerance;
    }
    const VectorXd wanted = deviation + slope * (result.coefficients - start);
    const VectorXd step =
        start + slope.transpose() * spread.ldlt().solve(wanted) - result.coefficients;
    double share = 1.0;
    double reached = cost(result.coefficients + step);
    while (!(reached < least) && share > 1e-3) {
      share *= 0.5;
      reached = cost(result.coefficients + share * step);
    }
    if (!(reached < least)) break;
    result.coefficients += share * step;
    const bool settled = least - reached < 1e-6 * least + 1e-9;
    least = reached;
    if (settled) break;
  }
  move(result.coefficients);
  deviate();
  result.worst_deviation = count > 0 ? deviation.cwiseAbs().maxCoeff() : 0.0;
  return result;
}

}  // namespace skullstation
