#include "reconstruction/distance/surface_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using skullstation::testing::sphere;

TEST(SurfaceSamples, CoverTheAreaAtTheDensityAskedFor) {
  const TriangleMesh mesh = sphere(50.0, 2);
  const auto samples = sample_surface(mesh, 1.0);
  ASSERT_TRUE(samples);
  double area_mm2 = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const SurfaceSample& sample : *samples) {
    EXPECT_LE(sample.area_mm2, 1.0);
    area_mm2 += sample.area_mm2;
    center += sample.area_mm2 * sample.point;
  }
  EXPECT_NEAR(area_mm2, surface_area(mesh), 1e-6);
  EXPECT_LT(center.norm() / area_mm2, 1e-9);
}

TEST(SurfaceSamples, LieOnTheirTriangleWithItsCentroidAsTheirMean) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 5, 3, 0, 5, 0, 3, 5;
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  const auto samples = sample_surface(mesh, 2.0);  // 4.5 mm^2: 3 x 3
  ASSERT_TRUE(samples);
  ASSERT_EQ(samples->size(), 9U);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const SurfaceSample& sample : *samples) {
    EXPECT_GT(sample.point.x(), 0.0);
    EXPECT_GT(sample.point.y(), 0.0);
    EXPECT_LT(sample.point.x() + sample.point.y(), 3.0);
    EXPECT_EQ(sample.point.z(), 5.0);
    mean += sample.point / 9.0;
  }
  EXPECT_LT((mean - Eigen::Vector3d(1, 1, 5)).norm(), 1e-12);
}

TEST(SurfaceSamples, LongThinTrianglesAreSampledAlongTheirLength) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 88, 0, 0, 88, 0.001, 0;
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  const auto samples = sample_surface(mesh, 1.0);
  ASSERT_TRUE(samples);
  EXPECT_EQ(samples->size(), 900U);
}

TEST(SurfaceSamples, AMeshInOtherUnitsIsRefused) {
  TriangleMesh mesh = sphere(50.0, 2);
  mesh.vertices *= 1e4;
  const auto samples = sample_surface(mesh, 1.0);
  ASSERT_FALSE(samples);
  EXPECT_THAT(samples.error().message(), ::testing::HasSubstr("millimetres"));
}

}  // namespace
}  // namespace skullstation
