#pragma once

#include <vector>

#include "core/random.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/registration/similarity_fit.h"

namespace skullstation {

/// One coarse skull for all tests of a program.
inline const TriangleMesh& test_skull() {
  static const TriangleMesh mesh = canonical_skull(3.0, 0);
  return mesh;
}

/// Uniform over all rotations (Shoemake 1992), within `reach_mm` of the origin.
inline Similarity3 random_pose(Random& random, double reach_mm) {
  Similarity3 pose;
  pose.rotation =
      Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
          .normalized();
  for (int c = 0; c < 3; ++c) pose.translation[c] = random.uniform(-reach_mm, reach_mm);
  return pose;
}

/// What is left when everything beyond a plane with the given normal is broken off, so that
/// `share` of the triangles is lost.
inline TriangleMesh broken(const TriangleMesh& mesh, const Eigen::Vector3d& normal, double share) {
  std::vector<std::pair<double, Eigen::Index>> order;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3d corner = mesh.vertices.row(mesh.triangles(t, 0));
    order.emplace_back(corner.dot(normal), t);
  }
  std::sort(order.begin(), order.end());
  TriangleMesh rest;
  rest.vertices = mesh.vertices;
  rest.triangles.resize(static_cast<Eigen::Index>((1.0 - share) * double(order.size())), 3);
  for (Eigen::Index t = 0; t < rest.triangles.rows(); ++t) {
    rest.triangles.row(t) = mesh.triangles.row(order[static_cast<std::size_t>(t)].second);
  }
  return rest;
}

}  // namespace skullstation
