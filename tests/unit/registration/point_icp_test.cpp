#include "reconstruction/registration/point_icp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/registration/skull_pieces.h"

namespace skullstation {
namespace {

TEST(PointIcp, BringsASkullHomeFromNearby) {
  const OrientedPoints target = *oriented_samples_of_count(test_skull(), 8000);
  const PointTree tree(target.positions);
  Similarity3 truth;
  truth.rotation = Eigen::AngleAxisd(0.12, Eigen::Vector3d(1, 2, -1).normalized());
  truth.translation = Eigen::Vector3d(4, -3, 5);
  const OrientedPoints source =
      *oriented_samples_of_count(moved(truth.inverse(), test_skull()), 2000);
  const auto fit = align_points(source, target, tree, Similarity3{},
                                {.max_distance_mm = 20.0, .max_iterations = 60});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT((fit->target_from_source.matrix() - truth.matrix()).norm(), 0.1);
  EXPECT_GT(fit->overlap, 0.75);
  EXPECT_EQ(fit->target_from_source.scale, 1.0);
}

TEST(PointIcp, FindsTheScaleWhenAsked) {
  const OrientedPoints target = *oriented_samples_of_count(test_skull(), 8000);
  const PointTree tree(target.positions);
  Similarity3 smaller;
  smaller.scale = 0.95;
  const OrientedPoints source = *oriented_samples_of_count(moved(smaller, test_skull()), 2000);
  const auto fit =
      align_points(source, target, tree, Similarity3{},
                   {.estimate_scale = true, .max_distance_mm = 20.0, .max_iterations = 60});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_NEAR(fit->target_from_source.scale, 1.0 / 0.95, 2e-3);
}

TEST(PointIcp, ErrorsSayWhatIsWrong) {
  const OrientedPoints skull = *oriented_samples_of_count(test_skull(), 500);
  const PointTree tree(skull.positions);
  Similarity3 far;
  far.translation.x() = 1000.0;
  EXPECT_THAT(align_points(skull, skull, tree, far, {}).error().message(),
              testing::HasSubstr("do not overlap"));
  EXPECT_EQ(align_points(skull, skull, tree, {}, {.max_distance_mm = 0.0}).error().kind,
            ErrorKind::usage);

  OrientedPoints plane;
  plane.positions.resize(400, 3);
  plane.normals = Points3::Zero(400, 3);
  plane.normals.col(2).setOnes();
  for (int i = 0; i < 400; ++i) plane.positions.row(i) << i % 20, i / 20, 0.0;
  EXPECT_THAT(align_points(plane, plane, PointTree(plane.positions), {}, {}).error().message(),
              testing::HasSubstr("slides"));
}

}  // namespace
}  // namespace skullstation
