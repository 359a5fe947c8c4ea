#include "reconstruction/registration/volume_energy.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <vector>

#include "core/linear_algebra.h"
#include "core/parallel.h"

namespace skullstation {

namespace {

constexpr int kNewtonSteps = 3;
constexpr int kGradientSteps = 40;

using Gradients = Eigen::Matrix<double, 4, 3>;

Gradients gradients(const Tetrahedra& tetrahedra, const Points3& rest, Eigen::Index t) {
  Eigen::Matrix3d edges;
  for (int i = 0; i < 3; ++i) {
    edges.row(i) = rest.row(tetrahedra(t, i + 1)) - rest.row(tetrahedra(t, 0));
  }
  const Eigen::Matrix3d inverse = edges.inverse();
  Gradients result;
  result.bottomRows<3>() = inverse.transpose();
  result.row(0) = -inverse.transpose().colwise().sum();
  return result;
}

/// Derivative of a tetrahedron's volume by its corners [mm^2].
Gradients volume_derivative(const Tetrahedra& tetrahedra, const Points3& at, Eigen::Index t) {
  const Eigen::Vector3d a = at.row(tetrahedra(t, 0));
  const Eigen::Vector3d b = at.row(tetrahedra(t, 1));
  const Eigen::Vector3d c = at.row(tetrahedra(t, 2));
  const Eigen::Vector3d d = at.row(tetrahedra(t, 3));
  Gradients result;
  result.row(1) = ((c - a).cross(d - a) / 6.0).transpose();
  result.row(2) = ((d - a).cross(b - a) / 6.0).transpose();
  result.row(3) = ((b - a).cross(c - a) / 6.0).transpose();
  result.row(0) = -(result.row(1) + result.row(2) + result.row(3));
  return result;
}

double dot(const Points3& a, const Points3& b) { return (a.array() * b.array()).sum(); }

}  // namespace

Eigen::SparseMatrix<double> laplace_matrix(const Tetrahedra& tetrahedra, const Points3& rest) {
  const Eigen::VectorXd volumes = signed_volumes(tetrahedra, rest);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(16 * tetrahedra.rows()));
  for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
    const Gradients g = gradients(tetrahedra, rest, t);
    const Eigen::Matrix4d block = volumes[t] / volumes.sum() * g * g.transpose();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        entries.emplace_back(tetrahedra(t, i), tetrahedra(t, j), block(i, j));
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(rest.rows(), rest.rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

Eigen::Matrix3d nearest_of_unit_determinant(const Eigen::Matrix3d& matrix) {
  const SingularValues3 svd = singular_values(matrix);
  const Eigen::Vector3d given = svd.values;
  Eigen::Matrix3d u = svd.u;
  Eigen::Vector3d s = given;
  // A matrix that turns space inside out has its least direction turned back.
  const bool turned = (u * svd.v.transpose()).determinant() < 0.0;
  if (turned) {
    u.col(2) = -u.col(2);
    s[2] = -s[2];
  }
  const Eigen::Vector3d start = s;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int step = 0; step < 8; ++step) {
    const Eigen::Vector3d gradient(s[1] * s[2], s[0] * s[2], s[0] * s[1]);
    const double excess = s.prod() - 1.0;
    // Nearest point of the linearised constraint to the start, not to the last iterate.
    offset = (gradient.dot(offset) - excess) / std::max(gradient.squaredNorm(), 1e-12) * gradient;
    s = start + offset;
  }
  return u * s.asDiagonal() * svd.v.transpose();
}

Points3 volume_projection_pull(const Tetrahedra& tetrahedra, const Points3& rest,
                               const Points3& displacement, int threads) {
  const Eigen::VectorXd volumes = signed_volumes(tetrahedra, rest);
  const double all = volumes.sum();
  const auto count = static_cast<int>(tetrahedra.rows());
  std::vector<Gradients> pulls(static_cast<std::size_t>(count));
  constexpr int kChunk = 4096;
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int t = chunk * kChunk; t < std::min(count, (chunk + 1) * kChunk); ++t) {
      const Gradients g = gradients(tetrahedra, rest, t);
      Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
      for (int i = 0; i < 4; ++i) f += displacement.row(tetrahedra(t, i)).transpose() * g.row(i);
      const Eigen::Matrix3d wanted = nearest_of_unit_determinant(f) - Eigen::Matrix3d::Identity();
      pulls[static_cast<std::size_t>(t)] = volumes[t] / all * g * wanted.transpose();
    }
  });
  Points3 pull = Points3::Zero(rest.rows(), 3);
  for (int t = 0; t < count; ++t) {
    for (int i = 0; i < 4; ++i) {
      pull.row(tetrahedra(t, i)) += pulls[static_cast<std::size_t>(t)].row(i);
    }
  }
  return pull;
}

Points3 solve_volume_energy(const Tetrahedra& tetrahedra, const Points3& rest,
                            const Eigen::VectorXd& weights, const Points3& targets,
                            double regularization, const Points3& start) {
  const Eigen::VectorXd rest_volumes = signed_volumes(tetrahedra, rest);
  Points3 u = start;
  for (int newton = 0; newton < kNewtonSteps; ++newton) {
    const Points3 at = rest + u;
    const Eigen::VectorXd volumes = signed_volumes(tetrahedra, at);
    std::vector<Gradients> derivatives(static_cast<std::size_t>(tetrahedra.rows()));
    for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
      derivatives[static_cast<std::size_t>(t)] = volume_derivative(tetrahedra, at, t);
    }
    const auto apply = [&](const Points3& x) {
      Points3 result = weights.asDiagonal() * x;
      for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
        const Gradients& g = derivatives[static_cast<std::size_t>(t)];
        double change = 0.0;
        for (int i = 0; i < 4; ++i) change += g.row(i).dot(x.row(tetrahedra(t, i)));
        for (int i = 0; i < 4; ++i) {
          result.row(tetrahedra(t, i)) += regularization * change * g.row(i);
        }
      }
      return result;
    };
    Points3 residual = weights.asDiagonal() * (targets - u);
    for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
      const Gradients& g = derivatives[static_cast<std::size_t>(t)];
      for (int i = 0; i < 4; ++i) {
        residual.row(tetrahedra(t, i)) -=
            regularization * (volumes[t] - rest_volumes[t]) * g.row(i);
      }
    }
    Eigen::VectorXd diagonal = weights;
    for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
      for (int i = 0; i < 4; ++i) {
        diagonal[tetrahedra(t, i)] +=
            regularization / 3.0 * derivatives[static_cast<std::size_t>(t)].row(i).squaredNorm();
      }
    }
    const Eigen::VectorXd scale = diagonal.cwiseMax(1e-30).cwiseInverse();
    Points3 step = Points3::Zero(u.rows(), 3);
    Points3 preconditioned = scale.asDiagonal() * residual;
    Points3 direction = preconditioned;
    double energy = dot(residual, preconditioned);
    const double goal = 1e-6 * energy;
    for (int i = 0; i < kGradientSteps && energy > goal && energy > 0.0; ++i) {
      const Points3 moved = apply(direction);
      const double length = energy / dot(direction, moved);
      step += length * direction;
      residual -= length * moved;
      preconditioned = scale.asDiagonal() * residual;
      const double next = dot(residual, preconditioned);
      direction = preconditioned + next / energy * direction;
      energy = next;
    }
    u += step;
  }
  return u;
}

}  // namespace skullstation
