#include "reconstruction/phantom/space_warp.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/random.h"
#include "reconstruction/phantom/warp_basis.h"
#include "reconstruction/phantom/warp_conditioning.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

BumpGrid single_bump(const Vector3d& center, double width_mm, const Vector3d& displacement) {
  BumpGrid grid;
  grid.origin_mm = center;
  grid.width_mm = width_mm;
  grid.size = {1, 1, 1};
  grid.displacement_mm = displacement;
  return grid;
}

SpaceWarp some_warp() {
  SpaceWarp warp;
  warp.stretch(0, 0) = 0.05;
  warp.stretch(1, 2) = -0.03;
  warp.shift_mm = {1.0, -2.0, 3.0};
  warp.bumps = {single_bump({10, 20, 30}, 25.0, {4, -3, 2}),
                single_bump({-40, -60, 0}, 18.0, {-2, 3, 1})};
  warp.motion.translation = {5, 0, -1};
  warp.motion.rotation = Eigen::AngleAxisd(0.2, Vector3d::UnitX());
  return warp;
}

TEST(SpaceWarp, JacobianIsTheDerivative) {
  const SpaceWarp warp = some_warp();
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Vector3d p(random.uniform(-80, 80), random.uniform(-80, 80), random.uniform(-80, 80));
    const Eigen::Matrix3d jacobian = warp.jacobian(p);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = 1e-4 * Vector3d::Unit(axis);
      const Vector3d slope = (warp(p + step) - warp(p - step)) / 2e-4;
      EXPECT_NEAR((jacobian.col(axis) - slope).norm(), 0.0, 1e-6);
    }
  }
}

TEST(SpaceWarp, SourceIsTheInverse) {
  const SpaceWarp warp = some_warp();
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Vector3d p(random.uniform(-80, 80), random.uniform(-80, 80), random.uniform(-80, 80));
    const auto source = warp.source_of(warp(p));
    ASSERT_TRUE(source.has_value());
    EXPECT_NEAR((*source - p).norm(), 0.0, 1e-5);
  }
}

TEST(SpaceWarp, AFoldHasANegativeDeterminant) {
  SpaceWarp warp;
  warp.bumps = {single_bump({0, 0, 0}, 10.0, {-30, 0, 0})};
  const Eigen::AlignedBox3d box(Vector3d::Constant(-30.0), Vector3d::Constant(30.0));
  EXPECT_LT(least_determinant(warp, box, 5.0, 2), 0.0);
  EXPECT_GT(least_determinant(some_warp(), box, 5.0, 1), 0.5);
}

WarpBasis small_basis() {
  WarpBasisOptions options;
  options.asymmetric_share = 0.5;
  options.layers = {{40.0, 40.0, 5.0, [](const Vector3d&) { return true; }}};
  return {{Vector3d::Constant(-90.0), Vector3d::Constant(90.0)}, options};
}

TEST(WarpBasis, DisplacementsAreThoseOfItsWarp) {
  const WarpBasis basis = small_basis();
  Random random(3);
  Eigen::VectorXd coefficients(basis.size());
  for (double& c : coefficients) c = random.normal();
  const SpaceWarp warp = basis.warp(coefficients);
  for (const Vector3d& p : {Vector3d(10, 20, 30), Vector3d(-50, 0, 20), Vector3d(0, -70, 5)}) {
    EXPECT_NEAR((warp(p) - p - basis.displacements(p) * coefficients).norm(), 0.0, 0.01);
  }
}

TEST(WarpConditioning, TheWarpHasTheMeasures) {
  const WarpBasis basis = small_basis();
  const std::vector<Vector3d> points = {{50, 0, 0}, {-50, 0, 0}, {0, -60, 0}, {0, 60, 0}};
  const std::vector<WarpTarget> targets = {{length_measure("breadth", 0, 1), 112.0, 0.01},
                                           {length_measure("length", 2, 3), 110.0, 0.01}};
  const ConditionedWarp fitted =
      condition_warp(basis, points, targets, Eigen::VectorXd::Zero(basis.size()));
  EXPECT_LT(fitted.worst_deviation, 0.02);
  const SpaceWarp warp = basis.warp(fitted.coefficients);
  EXPECT_NEAR((warp(points[0]) - warp(points[1])).norm(), 112.0, 0.05);
  // Nothing known is lopsided, so the likeliest warp is not.
  EXPECT_NEAR(warp(points[0]).x() + warp(points[1]).x(), 0.0, 1e-6);
}

TEST(WarpConditioning, AStartThatHasTheMeasuresStays) {
  const WarpBasis basis = small_basis();
  Random random(4);
  Eigen::VectorXd start(basis.size());
  for (double& c : start) c = 0.5 * random.normal();
  const SpaceWarp warp = basis.warp(start);
  const std::vector<Vector3d> points = {{50, 10, 0}, {-40, 0, 20}};
  const double length = (warp(points[0]) - warp(points[1])).norm();
  const ConditionedWarp fitted = condition_warp(
      basis, points, std::vector<WarpTarget>{{length_measure("l", 0, 1), length, 0.01}}, start);
  EXPECT_LT((fitted.coefficients - start).norm(), 0.01);
}

}  // namespace
}  // namespace skullstation
