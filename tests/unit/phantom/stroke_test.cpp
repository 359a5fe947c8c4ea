#include "reconstruction/phantom/stroke.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/random.h"
#include "reconstruction/phantom/sculpture.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

Vector3d random_point(Random& random, double reach_mm) {
  return {random.uniform(-reach_mm, reach_mm), random.uniform(-reach_mm, reach_mm),
          random.uniform(-reach_mm, reach_mm)};
}

TEST(SmoothMinimum, EqualsTheMinimumOutsideTheBlendAndLiesBelowInside) {
  EXPECT_DOUBLE_EQ(smooth_minimum(1.0, 4.0, 3.0), 1.0);
  EXPECT_DOUBLE_EQ(smooth_minimum(4.0, 1.0, 3.0), 1.0);
  EXPECT_DOUBLE_EQ(smooth_minimum(2.0, 2.0, 4.0), 1.0);
  EXPECT_DOUBLE_EQ(smooth_minimum(1.0, 2.0, 3.0), smooth_minimum(2.0, 1.0, 3.0));
}

TEST(StrokeShape, SphereAndBoxHaveTheirExactDistances) {
  Stroke sphere;
  sphere.center_mm = {1, 2, 3};
  sphere.half_size_mm = Vector3d::Constant(5.0);
  EXPECT_NEAR(StrokeShape(sphere).distance_mm({1, 2, 18}), 10.0, 1e-12);
  EXPECT_NEAR(StrokeShape(sphere).distance_mm({1, 2, 3}), -5.0, 1e-12);

  Stroke box;
  box.form = Stroke::Form::slab;
  box.half_size_mm = {3, 4, 5};
  EXPECT_NEAR(StrokeShape(box).distance_mm({6, 8, 0}), 5.0, 1e-12);
  EXPECT_NEAR(StrokeShape(box).distance_mm({0, 0, 0}), -3.0, 1e-12);
  box.rounding_mm = 1.0;  // the rounded corner lies (sqrt 2 - 1) deeper
  EXPECT_NEAR(StrokeShape(box).distance_mm({6, 8, 0}), std::hypot(4, 5) - 1.0, 1e-12);
}

TEST(StrokeShape, TurnsCounterClockwiseAboutItsRotationVector) {
  Stroke bar;
  bar.half_size_mm = {10, 1, 1};
  bar.rotation_deg = {0, 0, 90};
  EXPECT_NEAR(StrokeShape(bar).distance_mm({0, 10, 0}), 0.0, 1e-9);
  EXPECT_GT(StrokeShape(bar).distance_mm({10, 0, 0}), 5.0);
}

TEST(StrokeShape, APairIsSymmetric) {
  Stroke stroke;
  stroke.paired = true;
  stroke.center_mm = {4, 1, 0};
  stroke.half_size_mm = {6, 2, 3};
  stroke.rotation_deg = {10, 20, 30};
  stroke.blend_mm = 3.0;
  const StrokeShape shape(stroke);
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Vector3d p = random_point(random, 15.0);
    EXPECT_EQ(shape.distance_mm(p), shape.distance_mm({-p.x(), p.y(), p.z()}));
  }
}

TEST(StrokeShape, LowerBoundHoldsInTheWholeBall) {
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    Stroke stroke;
    stroke.form = i % 2 == 0 ? Stroke::Form::ellipsoid : Stroke::Form::slab;
    stroke.paired = i % 3 == 0;
    stroke.center_mm = random_point(random, 10.0);
    stroke.half_size_mm = {random.uniform(1, 8), random.uniform(1, 8), random.uniform(1, 8)};
    stroke.rotation_deg = random_point(random, 90.0);
    stroke.blend_mm = random.uniform(0.5, 5.0);
    const StrokeShape shape(stroke);
    const Vector3d center = random_point(random, 40.0);
    const double bound = shape.lower_bound_mm(center, 4.0);
    if (bound <= 0.0) continue;
    for (int k = 0; k < 20; ++k) {
      const Vector3d p = center + random.uniform(0, 4) * random_point(random, 1.0).normalized();
      EXPECT_GE(shape.distance_mm(p), bound - 1e-9);
    }
  }
}

TEST(StrokeShape, BoundsHoldTheForm) {
  Random random(3);
  Stroke stroke;
  stroke.paired = true;
  stroke.center_mm = {3, 1, 2};
  stroke.half_size_mm = {9, 2, 4};
  stroke.rotation_deg = {30, -40, 55};
  const StrokeShape shape(stroke);
  const Eigen::AlignedBox3d box = shape.bounds();
  for (int i = 0; i < 3000; ++i) {
    const Vector3d p = random_point(random, 14.0);
    if (shape.distance_mm(p) <= 0.0) {
      EXPECT_TRUE(box.contains(p));
    }
  }
}

TEST(Sculpture, CarvingTakesAwayAndALaterStrokeAddsAgain) {
  Stroke ball;
  ball.half_size_mm = Vector3d::Constant(10.0);
  Stroke hollow = ball;
  hollow.tool = Stroke::Tool::carve;
  hollow.half_size_mm = Vector3d::Constant(8.0);
  Stroke core = ball;
  core.half_size_mm = Vector3d::Constant(3.0);
  const std::vector<Stroke> strokes = {ball, hollow, core};
  const Sculpture shell(strokes);
  EXPECT_LT(shell.distance_mm({9, 0, 0}), 0.0);
  EXPECT_GT(shell.distance_mm({5.5, 0, 0}), 0.0);
  EXPECT_LT(shell.distance_mm({0, 0, 0}), 0.0);
  EXPECT_GT(shell.distance_mm({11, 0, 0}), 0.0);
}

}  // namespace
}  // namespace skullstation
