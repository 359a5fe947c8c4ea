#include "reconstruction/registration/global_registration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/registration/skull_pieces.h"

namespace skullstation {
namespace {

/// RMS distance [mm] between where the source's vertices come to lie and where they belong.
double error_mm(const Similarity3& found, const Similarity3& truth, const TriangleMesh& source) {
  double squares = 0.0;
  for (Eigen::Index v = 0; v < source.vertices.rows(); ++v) {
    const Eigen::Vector3d x = source.vertices.row(v);
    squares += (found * x - truth * x).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(source.vertices.rows()));
}

TEST(GlobalRegistration, FindsASkullInAnyPose) {
  Random random(1);
  for (int trial = 0; trial < 3; ++trial) {
    const Similarity3 pose = random_pose(random, 500.0);
    const TriangleMesh source = moved(pose, test_skull());
    const auto found = register_globally(source, test_skull());
    ASSERT_TRUE(found) << found.error().message();
    EXPECT_LT(error_mm(found->target_from_source, pose.inverse(), source), 0.5) << trial;
    EXPECT_GT(found->overlap, 0.7);  // thin walls blur normals at this spacing
    EXPECT_GT(found->runner_up, 1.5);
  }
}

TEST(GlobalRegistration, FindsThePlaceOfABrokenSkull) {
  Random random(2);
  for (int trial = 0; trial < 3; ++trial) {
    const Similarity3 pose = random_pose(random, 500.0);
    const Eigen::Vector3d direction = random_pose(random, 1.0).rotation * Eigen::Vector3d::UnitX();
    const TriangleMesh source = moved(pose, broken(test_skull(), direction, 0.4));
    const auto found = register_globally(source, test_skull());
    ASSERT_TRUE(found) << found.error().message();
    EXPECT_LT(error_mm(found->target_from_source, pose.inverse(), source), 1.0) << trial;
  }
}

TEST(GlobalRegistration, AnUnknownUnitIsFound) {
  Random random(3);
  for (const double scale : {0.001, 1.0 / 25.4, 1.07, 10.0}) {
    Similarity3 pose = random_pose(random, 5.0);
    pose.scale = scale;
    const TriangleMesh source = moved(pose, test_skull());
    const auto found = register_globally(source, test_skull(), {.scale = ScaleKnowledge::unknown});
    ASSERT_TRUE(found) << found.error().message();
    EXPECT_NEAR(found->target_from_source.scale * scale, 1.0, 2e-3);
    EXPECT_LT(error_mm(found->target_from_source, pose.inverse(), source), 0.5) << scale;
  }
}

TEST(GlobalRegistration, TheSameForAnyNumberOfThreads) {
  Random random(4);
  const TriangleMesh source = moved(random_pose(random, 100.0), test_skull());
  const auto one = register_globally(source, test_skull(), {.threads = 1});
  const auto three = register_globally(source, test_skull(), {.threads = 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->target_from_source.matrix(), three->target_from_source.matrix());
  EXPECT_EQ(one->runner_up, three->runner_up);
}

TEST(GlobalRegistration, WhatDoesNotFitIsRefused) {
  TriangleMesh cube;
  cube.vertices.resize(8, 3);
  for (int v = 0; v < 8; ++v) cube.vertices.row(v) << (v & 1), (v >> 1 & 1), (v >> 2);
  cube.vertices *= 150.0;
  cube.triangles.resize(12, 3);
  cube.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6,
      0, 6, 2, 1, 3, 7, 1, 7, 5;
  const auto found = register_globally(cube, test_skull());
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::no_result);
  EXPECT_THAT(found.error().message(), testing::HasSubstr("fits the other"));

  EXPECT_EQ(register_globally(TriangleMesh{}, cube).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(register_globally(cube, cube, {.hypotheses = 0}).error().kind, ErrorKind::usage);
  std::stop_source stop;
  stop.request_stop();
  Progress progress;
  progress.stop = stop.get_token();
  EXPECT_EQ(register_globally(cube, cube, {}, progress).error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
