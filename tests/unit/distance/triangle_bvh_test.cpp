#include "reconstruction/distance/triangle_bvh.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "reconstruction/distance/pseudo_normals.h"
#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using skullstation::testing::potato;
using skullstation::testing::sphere;

Eigen::Vector3d random_point(Random& random, double half_size) {
  return {random.uniform(-half_size, half_size), random.uniform(-half_size, half_size),
          random.uniform(-half_size, half_size)};
}

TEST(ClosestPointOnTriangle, EveryFeatureIsFound) {
  const Eigen::Vector3d a(0, 0, 0);
  const Eigen::Vector3d b(4, 0, 0);
  const Eigen::Vector3d c(0, 4, 0);
  const auto feature = [&](double x, double y) {
    const ClosestPoint closest = closest_point_on_triangle({x, y, 3.0}, a, b, c);
    EXPECT_NEAR(closest.distance_mm, (Eigen::Vector3d(x, y, 3.0) - closest.point).norm(), 1e-15);
    return closest.feature;
  };
  EXPECT_EQ(feature(-1, -1), TriangleFeature::corner0);
  EXPECT_EQ(feature(6, -1), TriangleFeature::corner1);
  EXPECT_EQ(feature(-1, 6), TriangleFeature::corner2);
  EXPECT_EQ(feature(2, -1), TriangleFeature::edge0);
  EXPECT_EQ(feature(3, 3), TriangleFeature::edge1);
  EXPECT_EQ(feature(-1, 2), TriangleFeature::edge2);
  EXPECT_EQ(feature(1, 1), TriangleFeature::face);
  EXPECT_EQ(closest_point_on_triangle({3, 3, 0}, a, b, c).point, Eigen::Vector3d(2, 2, 0));
}

TEST(TriangleBvh, AgreesWithTryingEveryTriangle) {
  const TriangleMesh mesh = potato(3);
  const TriangleBvh bvh(mesh);
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d query = random_point(random, 150.0);
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
      least =
          std::min(least, closest_point_on_triangle(query, mesh.vertices.row(mesh.triangles(f, 0)),
                                                    mesh.vertices.row(mesh.triangles(f, 1)),
                                                    mesh.vertices.row(mesh.triangles(f, 2)))
                              .distance_mm);
    }
    EXPECT_EQ(bvh.closest(query).distance_mm, least);
  }
}

TEST(TriangleBvh, NothingIsFoundBeyondTheSearchDistanceOrInNoMesh) {
  const TriangleBvh bvh(sphere(10.0, 2));
  EXPECT_EQ(bvh.closest({0, 0, 30}, 19.9).triangle, -1);
  EXPECT_GE(bvh.closest({0, 0, 30}, 20.1).triangle, 0);
  EXPECT_EQ(TriangleBvh(TriangleMesh{}).closest({0, 0, 0}).triangle, -1);
}

TEST(TriangleBvh, SliversDoNotSpoilTheResult) {
  TriangleMesh mesh = sphere(10.0, 2);
  const auto count = mesh.triangles.rows();
  mesh.triangles.conservativeResize(count + 2, 3);
  mesh.triangles.row(count) << 0, 0, 0;
  mesh.triangles.row(count + 1) << 0, 4, 4;
  const TriangleBvh bvh(mesh);
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const ClosestPoint closest = bvh.closest(random_point(random, 20.0));
    EXPECT_GE(closest.triangle, 0);
    EXPECT_TRUE(closest.point.allFinite());
  }
}

TEST(PseudoNormals, TellInsideFromOutsideOfACubeAtFacesEdgesAndCorners) {
  TriangleMesh cube;
  cube.vertices.resize(8, 3);
  cube.vertices << -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1,
      1;
  cube.triangles.resize(12, 3);
  cube.triangles << 0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7,
      2, 7, 6, 3, 0, 4, 3, 4, 7;
  const TriangleBvh bvh(cube);
  const PseudoNormals normals(cube);
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d query = random_point(random, 2.0);
    const Eigen::Vector3d q = query.cwiseAbs() - Eigen::Vector3d::Ones();
    const double truth = q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
    EXPECT_NEAR(normals.signed_distance_mm(query, bvh.closest(query)), truth, 1e-12);
  }
}

}  // namespace
}  // namespace skullstation
