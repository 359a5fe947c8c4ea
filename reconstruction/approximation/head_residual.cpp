#include "reconstruction/approximation/head_residual.h"

#include <Eigen/SparseCholesky>
#include <set>

namespace skullstation {

namespace {

using Matrix = Eigen::SparseMatrix<double>;

/// Information of a vertex's shift about the mean of its neighbours' [1/mm^2]: over the template's
/// edges of 3.5 to 6 mm, shifts of less than a centimetre across are noise.
constexpr double kBending = 10.0;

/// Each vertex less the mean of its neighbours.
Matrix umbrella(const Triangles& triangles, Eigen::Index count) {
  std::vector<std::set<int>> neighbours(static_cast<std::size_t>(count));
  for (Eigen::Index f = 0; f < triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = triangles(f, k);
      const int b = triangles(f, (k + 1) % 3);
      neighbours[static_cast<std::size_t>(a)].insert(b);
      neighbours[static_cast<std::size_t>(b)].insert(a);
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index v = 0; v < count; ++v) {
    const auto& around = neighbours[static_cast<std::size_t>(v)];
    if (around.empty()) continue;
    entries.emplace_back(static_cast<int>(v), static_cast<int>(v), 1.0);
    for (const int other : around) {
      entries.emplace_back(static_cast<int>(v), other, -1.0 / static_cast<double>(around.size()));
    }
  }
  Matrix result(count, count);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

Eigen::VectorXd residual_shift_mm(const Triangles& triangles,
                                  const std::vector<WantedShift>& wanted, double residual_sd_mm) {
  const auto count = static_cast<Eigen::Index>(wanted.size());
  const double hold = 1.0 / (residual_sd_mm * residual_sd_mm);
  const Matrix bend = umbrella(triangles, count);
  Matrix information = kBending * Matrix(bend.transpose() * bend);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  for (Eigen::Index v = 0; v < count; ++v) {
    const WantedShift& shift = wanted[static_cast<std::size_t>(v)];
    information.coeffRef(v, v) += hold + shift.information;
    right[v] = shift.information * shift.mm;
  }
  // Positive definite by its diagonal.
  return Eigen::SimplicialLDLT<Matrix>(information).solve(right);
}

}  // namespace skullstation
