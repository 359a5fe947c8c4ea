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
};

}  // namespace skullstation
