#include "reconstruction/registration/head_led_by_skull.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/random.h"

namespace skullstation {
namespace {

using Eigen::RowVector3d;
using Eigen::Vector3d;

/// Points on a sphere about the origin.
Points3 on_a_sphere(double radius_mm, int count, std::uint64_t seed) {
  Random random(seed);
  Points3 points(count, 3);
  for (int i = 0; i < count; ++i) {
    const Vector3d way(random.normal(0.0, 1.0), random.normal(0.0, 1.0), random.normal(0.0, 1.0));
    points.row(i) = radius_mm * way.normalized().transpose();
  }
  return points;
}

/// A ball of bone with skin 10 mm about it. Of the bone's vertices the last ones lie inside: they
/// are not outer and have no say.
struct Ball {
  SkullTemplate skull;
  HeadTemplate head;

  Ball() {
    constexpr int outer = 2000, inner = 100;
    skull.vertices.resize(outer + inner, 3);
    skull.vertices.topRows(outer) = on_a_sphere(80.0, outer, 1);
    skull.vertices.bottomRows(inner) = on_a_sphere(40.0, inner, 2);
    skull.boundary_count = outer + inner;
    skull.outer.assign(outer, true);
    skull.outer.resize(outer + inner, false);
    head.vertices = on_a_sphere(90.0, 300, 3);
  }
};

/// The lower half sinks and comes forward, as a long face does beneath its orbits.
RowVector3d lengthened(const RowVector3d& at) {
  const double below = 0.5 - 0.5 * std::tanh(at.z() / 30.0);
  return at + below * RowVector3d(0.0, -8.0, -15.0);
}

TEST(HeadLedBySkull, GoesWithAnAffineSkullExactly) {
  const Ball ball;
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() << 1.1, 0.2, 0.0, -0.1, 0.9, 0.3, 0.0, 0.1, 1.3;
  map.translation() = Vector3d(30.0, -400.0, 5.0);
  const auto moved = [&](const Points3& points) {
    return Points3((points * map.linear().transpose()).rowwise() +
                   RowVector3d(map.translation().transpose()));
  };
  FittedSkull fit;
  fit.vertices = moved(ball.skull.vertices);
  // What lies inside may be anywhere.
  fit.vertices.bottomRows(100).setConstant(1e6);
  const Points3 led = head_led_by_skull(ball.head, ball.skull, fit);
  EXPECT_TRUE(led.isApprox(moved(ball.head.vertices), 1e-9));
}

TEST(HeadLedBySkull, FollowsWhereTheBoneBends) {
  const Ball ball;
  FittedSkull fit;
  fit.vertices = ball.skull.vertices;
  for (Eigen::Index v = 0; v < fit.vertices.rows(); ++v) {
    fit.vertices.row(v) = lengthened(fit.vertices.row(v));
  }
  const Points3 led = head_led_by_skull(ball.head, ball.skull, fit);
  double worst_mm = 0.0, most_mm = 0.0;
  for (Eigen::Index v = 0; v < led.rows(); ++v) {
    const RowVector3d at = ball.head.vertices.row(v);
    worst_mm = std::max(worst_mm, (led.row(v) - lengthened(at)).norm());
    most_mm = std::max(most_mm, (lengthened(at) - at).norm());
  }
  EXPECT_GT(most_mm, 15.0);
  EXPECT_LT(worst_mm, 1.5);
}

}  // namespace
}  // namespace skullstation
