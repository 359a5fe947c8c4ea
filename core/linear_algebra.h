#pragma once

#include <Eigen/Core>

namespace skullstation {

// Eigen's decompositions take long to compile; here they are compiled once.

/// Eigenvalues of a symmetric matrix in ascending order and their unit eigenvectors as columns.
struct SymmetricSpectrum {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricSpectrum symmetric_spectrum(const Eigen::MatrixXd& symmetric);

/// matrix = u diag(values) v^T, the values descending.
struct SingularValues3 {
  Eigen::Matrix3d u;
  Eigen::Vector3d values;
  Eigen::Matrix3d v;
};
SingularValues3 singular_values(const Eigen::Matrix3d& matrix);

}  // namespace skullstation
