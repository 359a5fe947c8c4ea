#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

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

/// The x of least length that comes nearest to matrix x = right, also where the matrix is singular.
Eigen::Vector3d least_squares(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right);

/// The rotation by the least angle that turns `from` into the direction of `to`, of any length > 0.
Eigen::Quaterniond shortest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace skullstation
