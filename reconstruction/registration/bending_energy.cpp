#include "reconstruction/registration/bending_energy.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <tuple>

#include "core/linear_algebra.h"
#include "core/parallel.h"

namespace skullstation {

namespace {

using Vector = Eigen::Vector3d;

/// Height of a flap's triangle over its edge, in units of the edge.
constexpr double kLeastShape = 0.02;

double cotangent(const Vector& a, const Vector& b) {
  // Triangles without area would weigh without bound.
  return a.dot(b) / std::max(a.cross(b).norm(), 1e-9);
}

Eigen::Matrix3d best_rotation(const Eigen::Matrix3d& now_by_rest) {
  const SingularValues3 svd = singular_values(now_by_rest);
  Eigen::Matrix3d u = svd.u;
  if ((u * svd.v.transpose()).determinant() < 0.0) u.col(2) = -u.col(2);
  return u * svd.v.transpose();
}

}  // namespace

std::vector<EdgeFlap> edge_flaps(const Points3& rest, const Triangles& triangles) {
  struct Side {
    int a, b, opposite;
    bool forward;
  };
  std::vector<Side> sides;
  for (Eigen::Index f = 0; f < triangles.rows(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = triangles(f, i);
      const int b = triangles(f, (i + 1) % 3);
      sides.push_back({std::min(a, b), std::max(a, b), triangles(f, (i + 2) % 3), a < b});
    }
  }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.a, s.b, !s.forward); });
  std::vector<EdgeFlap> flaps;
  double all = 0.0;
  for (std::size_t s = 0; s + 1 < sides.size(); ++s) {
    const Side& one = sides[s];
    const Side& two = sides[s + 1];
    if (one.a != two.a || one.b != two.b) continue;
    const Vector x0 = rest.row(one.a);
    const Vector x1 = rest.row(one.b);
    const Vector x2 = rest.row(one.opposite);
    const Vector x3 = rest.row(two.opposite);
    const double c01 = cotangent(x1 - x0, x2 - x0);
    const double c02 = cotangent(x1 - x0, x3 - x0);
    const double c03 = cotangent(x0 - x1, x2 - x1);
    const double c04 = cotangent(x0 - x1, x3 - x1);
    const double area = 0.5 * ((x1 - x0).cross(x2 - x0).norm() + (x1 - x0).cross(x3 - x0).norm());
    // A triangle that is nearly a line has no rotation of its own, yet would weigh without bound.
    const double least = std::min((x1 - x0).cross(x2 - x0).norm(), (x1 - x0).cross(x3 - x0).norm());
    if (!(least > kLeastShape * (x1 - x0).squaredNorm())) continue;
    EdgeFlap flap;
    flap.corners = {one.a, one.b, one.opposite, two.opposite};
    flap.stencil = 3.0 / area * Eigen::Vector4d(c03 + c04, c01 + c02, -c01 - c03, -c02 - c04);
    flap.share = area / 3.0;
    all += flap.share;
    flaps.push_back(flap);
  }
  for (EdgeFlap& flap : flaps) flap.share /= all;
  return flaps;
}

Eigen::SparseMatrix<double> bending_matrix(const std::vector<EdgeFlap>& flaps,
                                           Eigen::Index vertices) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(16 * flaps.size());
  for (const EdgeFlap& flap : flaps) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        entries.emplace_back(flap.corners[static_cast<std::size_t>(i)],
                             flap.corners[static_cast<std::size_t>(j)],
                             flap.share * flap.stencil[i] * flap.stencil[j]);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(vertices, vertices);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

Points3 rotated_rest_pull(const std::vector<EdgeFlap>& flaps, const Points3& rest,
                          const Points3& now, int threads) {
  std::vector<Vector> wanted(flaps.size());
  constexpr int kChunk = 1024;
  const auto count = static_cast<int>(flaps.size());
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int e = chunk * kChunk; e < std::min(count, (chunk + 1) * kChunk); ++e) {
      const EdgeFlap& flap = flaps[static_cast<std::size_t>(e)];
      Eigen::Matrix3d now_by_rest = Eigen::Matrix3d::Zero();
      Vector laplacian = Vector::Zero();
      for (std::size_t i = 0; i < 4; ++i) {
        laplacian +=
            flap.stencil[static_cast<Eigen::Index>(i)] * rest.row(flap.corners[i]).transpose();
        if (i == 0) continue;
        now_by_rest += (now.row(flap.corners[i]) - now.row(flap.corners[0])).transpose() *
                       (rest.row(flap.corners[i]) - rest.row(flap.corners[0]));
      }
      wanted[static_cast<std::size_t>(e)] = best_rotation(now_by_rest) * laplacian;
    }
  });
  Points3 pull = Points3::Zero(rest.rows(), 3);
  for (std::size_t e = 0; e < flaps.size(); ++e) {
    for (std::size_t i = 0; i < 4; ++i) {
      pull.row(flaps[e].corners[i]) +=
          flaps[e].share * flaps[e].stencil[static_cast<Eigen::Index>(i)] * wanted[e].transpose();
    }
  }
  return pull;
}

}  // namespace skullstation
