#include "reconstruction/registration/deformation_solver.h"

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cassert>

#include "reconstruction/registration/smoothness_energy.h"
#include "reconstruction/registration/volume_energy.h"

namespace skullstation {

namespace {
using Matrix = Eigen::SparseMatrix<double>;
/// Error left in the energy norm, relative to the whole displacement's.
constexpr double kTolerance = 3e-3;
constexpr int kMaxSteps = 25;
}  // namespace

struct DeformationSolver::Parts {
  Matrix smoothness;
  Matrix laplace;  ///< on the pattern of `smoothness`
  Matrix stiff;    ///< the chosen sum of both
  Eigen::CholmodDecomposition<Matrix, Eigen::Lower> factor;
};

DeformationSolver::DeformationSolver(const SkullTemplate& skull)
    : parts_(std::make_unique<Parts>()) {
  parts_->smoothness = smoothness_matrix(skull.tetrahedra, skull.vertices);
  parts_->laplace = laplace_matrix(skull.tetrahedra, skull.vertices);
  Matrix pattern = parts_->smoothness + parts_->laplace;
  Matrix diagonal(pattern.rows(), pattern.cols());
  diagonal.setIdentity();
  pattern += diagonal;
  parts_->factor.setMode(Eigen::CholmodSupernodalLLt);
  parts_->factor.analyzePattern(pattern);
}

DeformationSolver::~DeformationSolver() = default;
DeformationSolver::DeformationSolver(DeformationSolver&&) noexcept = default;
DeformationSolver& DeformationSolver::operator=(DeformationSolver&&) noexcept = default;

void DeformationSolver::stiffen(double smooth_mm4, double volume, const Eigen::VectorXd& weights) {
  parts_->stiff = smooth_mm4 * parts_->smoothness + volume * parts_->laplace;
  Matrix sum = parts_->stiff;
  Matrix diagonal(sum.rows(), sum.cols());
  diagonal.setIdentity();
  diagonal.diagonal() = weights;
  sum += diagonal;
  parts_->factor.factorize(sum);
  assert(parts_->factor.info() == Eigen::Success);
}

Points3 DeformationSolver::solve(const DeformationTargets& targets, const Points3& pull,
                                 const Points3& start) const {
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  const auto weighted = [&](const auto& u) -> Columns {
    Columns result = targets.weight.asDiagonal() * u;
    for (Eigen::Index v = 0; v < u.rows(); ++v) {
      const Eigen::RowVector3d n = targets.normal.row(v);
      if (n.isZero() || targets.weight[v] == 0.0) continue;
      const Eigen::RowVector3d x = u.row(v);
      const Eigen::RowVector3d across = x.dot(n) * n;
      result.row(v) = targets.weight[v] * (across + targets.along * (x - across));
    }
    return result;
  };
  const auto apply = [&](const Columns& u) -> Columns { return parts_->stiff * u + weighted(u); };
  const auto dot = [](const Columns& a, const Columns& b) { return (a.array() * b.array()).sum(); };
  Columns right = weighted(targets.displacement);
  if (pull.rows() > 0) right += pull;
  Columns u = start;
  Columns residual = right - apply(u);
  Columns preconditioned = parts_->factor.solve(residual);
  Columns direction = preconditioned;
  double energy = dot(residual, preconditioned);
  const double goal = kTolerance * kTolerance * std::max(energy, dot(u, right));
  for (int step = 0; step < kMaxSteps && energy > goal && energy > 0.0; ++step) {
    const Columns moved = apply(direction);
    const double length = energy / dot(direction, moved);
    u += length * direction;
    residual -= length * moved;
    preconditioned = parts_->factor.solve(residual);
    const double next = dot(residual, preconditioned);
    direction = preconditioned + next / energy * direction;
    energy = next;
  }
  return u;
}

}  // namespace skullstation
