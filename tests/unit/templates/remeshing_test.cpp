#include "reconstruction/templates/remeshing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using testing::sphere;

/// How many triangles each edge has.
std::map<std::pair<int, int>, int> edge_uses(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int i = 0; i < 3; ++i) {
      ++uses[std::minmax(int{mesh.triangles(f, i)}, int{mesh.triangles(f, (i + 1) % 3)})];
    }
  }
  return uses;
}

TEST(Clipped, KeepsTheHalfOfABallWithItsRimInThePlane) {
  const TriangleMesh half = clipped(sphere(30.0, 4), Eigen::Vector3d::UnitX(), 0.0, 0.2);
  EXPECT_GE(half.vertices.col(0).minCoeff(), 0.0);
  EXPECT_NEAR(surface_area(half), 0.5 * 4.0 * M_PI * 900.0, 60.0);
  for (const auto& [edge, count] : edge_uses(half)) {
    ASSERT_LE(count, 2);
    if (count == 1) {
      EXPECT_EQ(half.vertices(edge.first, 0), 0.0);
      EXPECT_EQ(half.vertices(edge.second, 0), 0.0);
    }
  }
}

TEST(Remeshed, MakesEvenTrianglesOfTheWantedSizeOnTheSurface) {
  RemeshingOptions options;
  options.edge_mm = [](const Eigen::Vector3d&) { return 5.0; };
  options.project = [](const Eigen::Vector3d& point, const Eigen::Vector3d&) {
    return Eigen::Vector3d(30.0 * point.normalized());
  };
  const TriangleMesh mesh = remeshed(sphere(30.0, 4), options);
  const auto uses = edge_uses(mesh);
  double sum = 0.0;
  for (const auto& [edge, count] : uses) {
    EXPECT_EQ(count, 2) << "a closed surface stays closed";
    const double length = (mesh.vertices.row(edge.first) - mesh.vertices.row(edge.second)).norm();
    EXPECT_GT(length, 2.0);
    EXPECT_LT(length, 8.5);
    sum += length;
  }
  EXPECT_NEAR(sum / static_cast<double>(uses.size()), 5.0, 0.6);
  EXPECT_EQ(mesh.vertices.rows() - static_cast<Eigen::Index>(uses.size()) + mesh.triangles.rows(),
            2);
  EXPECT_NEAR(surface_area(mesh), 4.0 * M_PI * 900.0, 0.02 * 4.0 * M_PI * 900.0);
}

TEST(Remeshed, FollowsASizeThatVaries) {
  RemeshingOptions options;
  options.edge_mm = [](const Eigen::Vector3d& p) { return p.z() > 0.0 ? 3.0 : 9.0; };
  options.project = [](const Eigen::Vector3d& point, const Eigen::Vector3d&) {
    return Eigen::Vector3d(30.0 * point.normalized());
  };
  const TriangleMesh mesh = remeshed(sphere(30.0, 4), options);
  const auto above = (mesh.vertices.col(2).array() > 3.0).count();
  const auto below = (mesh.vertices.col(2).array() < -3.0).count();
  EXPECT_GT(above, 4 * below);
}

}  // namespace
}  // namespace skullstation
