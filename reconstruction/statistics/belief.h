#pragma once

#include <Eigen/Core>

namespace skullstation {

/// What is known of some numbers, coefficients of a model mostly: a Gaussian.
struct Belief {
  Eigen::VectorXd mean;        ///< n
  Eigen::MatrixXd covariance;  ///< n x n

  /// Nothing known of standardised coefficients but the population: mean 0, SD 1, independent.
  static Belief standard_normal(Eigen::Index count) {
    return {Eigen::VectorXd::Zero(count), Eigen::MatrixXd::Identity(count, count)};
  }

  /// Learns that row . numbers is `value`, give or take `variance`.
  void observe(const Eigen::VectorXd& row, double value, double variance) {
    const Eigen::VectorXd gain = covariance * row;
    const double expected_variance = row.dot(gain) + variance;
    mean += gain * ((value - row.dot(mean)) / expected_variance);
    covariance -= gain * gain.transpose() / expected_variance;
  }
};

}  // namespace skullstation
