#include "reconstruction/distance/pseudo_normals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace skullstation {

namespace {

struct HalfEdge {
  std::uint64_t edge = 0;  // both vertices, the lower one first
  int triangle = 0;
  int side = 0;
};

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

PseudoNormals::PseudoNormals(const TriangleMesh& mesh)
    : triangles_(mesh.triangles),
      face_normals_(Points3::Zero(mesh.triangles.rows(), 3)),
      vertex_normals_(Points3::Zero(mesh.vertices.rows(), 3)),
      neighbor_(Eigen::Matrix<int, Eigen::Dynamic, 3>::Constant(mesh.triangles.rows(), 3, -1)) {
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(static_cast<std::size_t>(mesh.triangles.size()));
  for (int f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
    const Eigen::Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
    const Eigen::Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
    const Eigen::Vector3d normal = (b - a).cross(c - a).stableNormalized();
    face_normals_.row(f) = normal;
    vertex_normals_.row(mesh.triangles(f, 0)) += angle_between(b - a, c - a) * normal.transpose();
    vertex_normals_.row(mesh.triangles(f, 1)) += angle_between(c - b, a - b) * normal.transpose();
    vertex_normals_.row(mesh.triangles(f, 2)) += angle_between(a - c, b - c) * normal.transpose();
    for (int side = 0; side < 3; ++side) {
      const auto from = static_cast<std::uint32_t>(mesh.triangles(f, side));
      const auto to = static_cast<std::uint32_t>(mesh.triangles(f, (side + 1) % 3));
      half_edges.push_back(
          {(std::uint64_t{std::min(from, to)} << 32) | std::max(from, to), f, side});
    }
  }
  std::ranges::sort(half_edges, [](const HalfEdge& left, const HalfEdge& right) {
    return left.edge != right.edge ? left.edge < right.edge : left.triangle < right.triangle;
  });
  // An edge of more than two triangles has no inside; its first two stand for it.
  for (std::size_t i = 0; i + 1 < half_edges.size(); ++i) {
    if (half_edges[i].edge != half_edges[i + 1].edge) continue;
    neighbor_(half_edges[i].triangle, half_edges[i].side) = half_edges[i + 1].triangle;
    neighbor_(half_edges[i + 1].triangle, half_edges[i + 1].side) = half_edges[i].triangle;
    ++i;
  }
}

Eigen::Vector3d PseudoNormals::at(const ClosestPoint& closest) const {
  const Eigen::Vector3d face = face_normals_.row(closest.triangle);
  const int feature = static_cast<int>(closest.feature);
  if (feature < 3) return vertex_normals_.row(triangles_(closest.triangle, feature));
  if (feature == 6) return face;
  const int other = neighbor_(closest.triangle, feature - 3);
  return other < 0 ? face : Eigen::Vector3d(face + face_normals_.row(other).transpose());
}

double PseudoNormals::signed_distance_mm(const Eigen::Vector3d& query,
                                         const ClosestPoint& closest) const {
  const bool behind = (query - closest.point).dot(at(closest)) < 0.0;
  return behind ? -closest.distance_mm : closest.distance_mm;
}

}  // namespace skullstation
