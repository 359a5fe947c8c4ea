#include "reconstruction/distance/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using skullstation::testing::moved;
using skullstation::testing::potato;
using skullstation::testing::sphere;
using ::testing::HasSubstr;

TEST(Comparison, ASurfaceIsAtNoDistanceFromItself) {
  const auto comparison = compare_surfaces(potato(3), potato(3), {});
  ASSERT_TRUE(comparison) << comparison.error().message();
  EXPECT_LT(comparison->hausdorff_mm, 1e-12);
  EXPECT_NEAR(comparison->a_to_b.area_mm2, surface_area(potato(3)), 1e-6);
  EXPECT_NEAR(comparison->a_to_b.histogram[0], 1.0, 1e-12);
}

TEST(Comparison, ConcentricSpheresAreTheirRadiiApart) {
  const auto comparison = compare_surfaces(sphere(52.0, 5), sphere(50.0, 5), {});
  ASSERT_TRUE(comparison) << comparison.error().message();
  for (const auto* way : {&comparison->a_to_b, &comparison->b_to_a}) {
    EXPECT_NEAR(way->mean_mm, 2.0, 0.01);
    EXPECT_NEAR(way->rms_mm, 2.0, 0.01);
    EXPECT_NEAR(way->median_mm, 2.0, 0.01);
    EXPECT_NEAR(way->p95_mm, 2.0, 0.02);
    EXPECT_NEAR(way->max_mm, 2.0, 0.02);
    EXPECT_NEAR(std::accumulate(way->histogram.begin(), way->histogram.end(), 0.0), 1.0, 1e-9);
  }
  EXPECT_NEAR(comparison->a_to_b.signed_mean_mm, 2.0, 0.01);
  EXPECT_NEAR(comparison->b_to_a.signed_mean_mm, -2.0, 0.01);
  EXPECT_NEAR(comparison->vertex_distance_b_mm[0], -2.0, 0.01);
}

TEST(Comparison, WeighsByAreaNotByVertices) {
  // Two squares over a plane: the near one finely meshed, the far one as large but coarse.
  TriangleMesh plane;
  plane.vertices.resize(4, 3);
  plane.vertices << -200, -200, 0, 200, -200, 0, 200, 200, 0, -200, 200, 0;
  plane.triangles.resize(2, 3);
  plane.triangles << 0, 1, 2, 0, 2, 3;
  TriangleMesh squares;
  const int cells = 20;
  squares.vertices.resize((cells + 1) * (cells + 1) + 4, 3);
  squares.triangles.resize(2 * cells * cells + 2, 3);
  for (int i = 0; i <= cells; ++i) {
    for (int j = 0; j <= cells; ++j) squares.vertices.row(i * (cells + 1) + j) << i, j, 1;
  }
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      const int corner = i * (cells + 1) + j;
      squares.triangles.row(2 * (i * cells + j)) << corner, corner + cells + 1, corner + 1;
      squares.triangles.row(2 * (i * cells + j) + 1) << corner + 1, corner + cells + 1,
          corner + cells + 2;
    }
  }
  squares.vertices.bottomRows(4) << 100, 0, 3, 120, 0, 3, 120, 20, 3, 100, 20, 3;
  const int first = (cells + 1) * (cells + 1);
  squares.triangles.bottomRows(2) << first, first + 1, first + 2, first, first + 2, first + 3;

  const auto comparison = compare_surfaces(squares, plane, {});
  ASSERT_TRUE(comparison) << comparison.error().message();
  EXPECT_NEAR(comparison->a_to_b.mean_mm, 2.0, 1e-9);
  EXPECT_NEAR(comparison->a_to_b.rms_mm, std::sqrt(5.0), 1e-9);
  EXPECT_NEAR(comparison->a_to_b.p95_mm, 3.0, 1e-9);
  EXPECT_NEAR(comparison->a_to_b.histogram[10], 0.5, 1e-9);
  EXPECT_NEAR(comparison->a_to_b.histogram[30], 0.5, 1e-9);
  EXPECT_GT(comparison->b_to_a.max_mm, 150.0) << "what only B has shows on the way back";
}

TEST(Comparison, TheRegionLimitsBothWays) {
  const TriangleMesh a = sphere(52.0, 4);
  TriangleMesh b = sphere(50.0, 4);
  for (Eigen::Index v = 0; v < b.vertices.rows(); ++v) {
    if (b.vertices(v, 2) < -10.0) b.vertices(v, 2) *= 1.5;  // spoilt where nobody looks
  }
  ComparisonOptions options;
  for (Eigen::Index v = 0; v < a.vertices.rows(); ++v) {
    options.region.push_back(a.vertices(v, 2) > 10.0);
  }
  const auto comparison = compare_surfaces(a, b, options);
  ASSERT_TRUE(comparison) << comparison.error().message();
  EXPECT_NEAR(comparison->a_to_b.max_mm, 2.0, 0.1);
  EXPECT_NEAR(comparison->b_to_a.max_mm, 2.0, 0.1);
  EXPECT_LT(comparison->a_to_b.area_mm2, 0.5 * surface_area(a));
  EXPECT_LT(comparison->b_to_a.area_mm2, 0.5 * surface_area(b));
}

TEST(Comparison, AlignmentTakesTheMotionOutAndReportsIt) {
  const TriangleMesh a = potato(4);
  Similarity3 motion;
  motion.scale = 1.05;
  motion.translation = {3.0, 2.0, -4.0};
  ComparisonOptions options;
  const auto before = compare_surfaces(a, moved(a, motion), options);
  options.align = Alignment::similarity;
  const auto after = compare_surfaces(a, moved(a, motion), options);
  ASSERT_TRUE(before && after);
  EXPECT_GT(before->a_to_b.mean_mm, 2.0);
  EXPECT_LT(after->hausdorff_mm, 0.02);
  EXPECT_NEAR(after->b_from_a.scale, 1.05, 1e-4);
  options.align = Alignment::rigid;
  const auto rigid = compare_surfaces(a, moved(a, motion), options);
  ASSERT_TRUE(rigid);
  EXPECT_EQ(rigid->b_from_a.scale, 1.0);
  EXPECT_GT(rigid->a_to_b.mean_mm, 1.0);
}

TEST(Comparison, IsTheSameForAnyNumberOfThreads) {
  ComparisonOptions options;
  options.threads = 1;
  const auto one = compare_surfaces(potato(4), sphere(80.0, 4), options);
  options.threads = 4;
  const auto four = compare_surfaces(potato(4), sphere(80.0, 4), options);
  ASSERT_TRUE(one && four);
  EXPECT_EQ(one->a_to_b.mean_mm, four->a_to_b.mean_mm);
  EXPECT_EQ(one->b_to_a.p95_mm, four->b_to_a.p95_mm);
  EXPECT_EQ(one->a_to_b.histogram, four->a_to_b.histogram);
  EXPECT_EQ(one->vertex_distance_a_mm, four->vertex_distance_a_mm);
}

TEST(Comparison, WhatCannotBeComparedIsRefused) {
  const auto empty = compare_surfaces(TriangleMesh{}, potato(2), {});
  ASSERT_FALSE(empty);
  EXPECT_THAT(empty.error().message(), HasSubstr("mesh A: has no surface"));
  EXPECT_FALSE(compare_surfaces(potato(2), TriangleMesh{}, {}));
  ComparisonOptions options;
  options.region.assign(3, true);
  const auto odd = compare_surfaces(potato(2), potato(2), options);
  ASSERT_FALSE(odd);
  EXPECT_THAT(odd.error().message(), HasSubstr("region: tells of 3 vertices"));
  options.region.assign(static_cast<std::size_t>(potato(2).vertices.rows()), false);
  const auto nothing = compare_surfaces(potato(2), potato(2), options);
  ASSERT_FALSE(nothing);
  EXPECT_THAT(nothing.error().message(), HasSubstr("covers no triangle"));
  options = {};
  options.samples_per_mm2 = 0.0;
  EXPECT_EQ(compare_surfaces(potato(2), potato(2), options).error().kind, ErrorKind::usage);
}

TEST(Comparison, ColoursTellTheSignAndTheRegion) {
  const TriangleMesh mesh = colored_by_distance(sphere(1.0, 0), {0.0, 2.0, -2.0, 9.0, 0.5, 0.0},
                                                2.0, {true, true, true, true, true, false});
  EXPECT_EQ(mesh.colors.row(0), (Eigen::Matrix<std::uint8_t, 1, 3>(247, 247, 247)));
  EXPECT_EQ(mesh.colors.row(1), (Eigen::Matrix<std::uint8_t, 1, 3>(178, 24, 43)));
  EXPECT_EQ(mesh.colors.row(2), (Eigen::Matrix<std::uint8_t, 1, 3>(33, 102, 172)));
  EXPECT_EQ(mesh.colors.row(3), mesh.colors.row(1));
  EXPECT_EQ(mesh.colors.row(5), (Eigen::Matrix<std::uint8_t, 1, 3>(128, 128, 128)));
}

}  // namespace
}  // namespace skullstation
