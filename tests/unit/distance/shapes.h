#pragma once

#include <map>
#include <utility>

#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation::testing {

/// Unit sphere from an octahedron, each triangle cut in four `depth` times; outward.
inline TriangleMesh sphere(double radius_mm, int depth) {
  TriangleMesh mesh;
  mesh.vertices.resize(6, 3);
  mesh.vertices << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
  mesh.triangles.resize(8, 3);
  mesh.triangles << 0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5;
  for (int i = 0; i < depth; ++i) {
    std::map<std::pair<int, int>, int> middle;
    Triangles finer(4 * mesh.triangles.rows(), 3);
    const auto between = [&](int a, int b) {
      const auto [entry, is_new] =
          middle.emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.rows()));
      if (is_new) {
        mesh.vertices.conservativeResize(mesh.vertices.rows() + 1, 3);
        mesh.vertices.row(entry->second) =
            (mesh.vertices.row(a) + mesh.vertices.row(b)).normalized();
      }
      return entry->second;
    };
    for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
      const int a = mesh.triangles(f, 0);
      const int b = mesh.triangles(f, 1);
      const int c = mesh.triangles(f, 2);
      const int ab = between(a, b);
      const int bc = between(b, c);
      const int ca = between(c, a);
      finer.middleRows(4 * f, 4) << a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca;
    }
    mesh.triangles = finer;
  }
  mesh.vertices *= radius_mm;
  return mesh;
}

/// A smooth body without any symmetry, about 80 mm in radius.
inline TriangleMesh potato(int depth) {
  TriangleMesh mesh = sphere(1.0, depth);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d n = mesh.vertices.row(v);
    const double radius_mm = 80.0 + 12.0 * n.x() * n.y() + 9.0 * n.z() * n.z() * n.x() +
                             7.0 * n.y() * n.y() * n.y() - 6.0 * n.z() * n.x();
    mesh.vertices.row(v) = radius_mm * n.cwiseProduct(Eigen::RowVector3d(1.0, 1.2, 0.85));
  }
  return mesh;
}

inline TriangleMesh moved(TriangleMesh mesh, const Similarity3& transform) {
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d point = mesh.vertices.row(v);
    mesh.vertices.row(v) = transform * point;
  }
  return mesh;
}

}  // namespace skullstation::testing
