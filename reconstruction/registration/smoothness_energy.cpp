#include "reconstruction/registration/smoothness_energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace skullstation {

namespace {

constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

struct Side {
  std::array<int, 3> face;  ///< sorted
  int tetrahedron;
  int opposite;  ///< corner of the tetrahedron, 0 .. 3
};

std::vector<Side> sorted_sides(const Tetrahedra& tetrahedra) {
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(4 * tetrahedra.rows()));
  for (int t = 0; t < tetrahedra.rows(); ++t) {
    for (int i = 0; i < 4; ++i) {
      Side side{
          {tetrahedra(t, kFaces[i][0]), tetrahedra(t, kFaces[i][1]), tetrahedra(t, kFaces[i][2])},
          t,
          i};
      std::ranges::sort(side.face);
      sides.push_back(side);
    }
  }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::pair(s.face, s.tetrahedron); });
  return sides;
}

/// Gradients of the four barycentric coordinates, one a row [1/mm].
Eigen::Matrix<double, 4, 3> gradients(const Tetrahedra& tetrahedra, const Points3& rest, int t) {
  Eigen::Matrix3d edges;
  for (int i = 0; i < 3; ++i) {
    edges.row(i) = rest.row(tetrahedra(t, i + 1)) - rest.row(tetrahedra(t, 0));
  }
  const Eigen::Matrix3d inverse = edges.inverse();
  Eigen::Matrix<double, 4, 3> result;
  result.bottomRows<3>() = inverse.transpose();
  result.row(0) = -inverse.transpose().colwise().sum();
  return result;
}

}  // namespace

Eigen::SparseMatrix<double> smoothness_matrix(const Tetrahedra& tetrahedra, const Points3& rest) {
  const Eigen::VectorXd volumes = signed_volumes(tetrahedra, rest);
  const double all = volumes.sum();
  const std::vector<Side> sides = sorted_sides(tetrahedra);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(sides.size() / 2 * 25);
  for (std::size_t s = 0; s + 1 < sides.size(); ++s) {
    const Side& a = sides[s];
    const Side& b = sides[s + 1];
    if (a.face != b.face) continue;
    const Eigen::Vector3d p = rest.row(a.face[0]);
    const Eigen::Vector3d q = rest.row(a.face[1]);
    const Eigen::Vector3d r = rest.row(a.face[2]);
    const Eigen::Vector3d twice = (q - p).cross(r - p);
    const double area = 0.5 * twice.norm();
    const Eigen::Vector3d normal = twice.normalized();
    const int over_a = tetrahedra(a.tetrahedron, a.opposite);
    const int over_b = tetrahedra(b.tetrahedron, b.opposite);
    const double apart =
        0.25 * std::abs(normal.dot((rest.row(over_b) - rest.row(over_a)).transpose()));
    const double distance = std::max(apart, 0.1 * std::sqrt(area));
    const double weight =
        0.25 * (volumes[a.tetrahedron] + volumes[b.tetrahedron]) / (distance * distance * all);
    // The gradient of a continuous function jumps along the face's normal only.
    const Eigen::Vector4d along_a = gradients(tetrahedra, rest, a.tetrahedron) * normal;
    const Eigen::Vector4d along_b = gradients(tetrahedra, rest, b.tetrahedron) * normal;
    std::array<std::pair<int, double>, 5> jump;
    for (int k = 0; k < 3; ++k) {
      double sum = 0.0;
      for (int i = 0; i < 4; ++i) {
        if (tetrahedra(a.tetrahedron, i) == a.face[k]) sum += along_a[i];
        if (tetrahedra(b.tetrahedron, i) == a.face[k]) sum -= along_b[i];
      }
      jump[static_cast<std::size_t>(k)] = {a.face[k], sum};
    }
    jump[3] = {over_a, along_a[a.opposite]};
    jump[4] = {over_b, -along_b[b.opposite]};
    for (const auto& [i, ci] : jump) {
      for (const auto& [j, cj] : jump) entries.emplace_back(i, j, weight * ci * cj);
    }
  }
  Eigen::SparseMatrix<double> matrix(rest.rows(), rest.rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace skullstation
