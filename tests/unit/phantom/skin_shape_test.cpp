#include "reconstruction/phantom/skin_shape.h"

#include <gtest/gtest.h>

#include <array>

#include "core/random.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/skin_tube.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

TEST(Tube, OfEqualRadiiHasTheDistancesOfACapsule) {
  constexpr std::array<TubePoint, 2> kPoints = {{{{0, 0, 0}, 2.0}, {{10, 0, 0}, 2.0}}};
  const Tube tube(kPoints);
  EXPECT_NEAR(tube.distance_mm({5, 0, 0}), -2.0, 1e-12);
  EXPECT_NEAR(tube.distance_mm({5, 6, 8}), 8.0, 1e-12);
  EXPECT_NEAR(tube.distance_mm({-3, 0, 4}), 3.0, 1e-12);
  EXPECT_NEAR(tube.distance_mm({13, 4, 0}), 3.0, 1e-12);
}

TEST(Tube, ItsRadiusChangesAlongTheAxis) {
  constexpr std::array<TubePoint, 3> kPoints = {
      {{{0, 0, 0}, 1.0}, {{10, 0, 0}, 3.0}, {{10, 10, 0}, 3.0}}};
  const Tube tube(kPoints);
  EXPECT_NEAR(tube.distance_mm({5, 0, 2}), 0.0, 1e-12);
  EXPECT_NEAR(tube.distance_mm({10, 5, 3}), 0.0, 1e-12);
  EXPECT_TRUE(tube.bounds().contains(Vector3d(12.9, 10, 2.9)));
}

constexpr std::array<TubePoint, 2> kBall = {{{{0, 0, -1}, 20.0}, {{0, 0, 1}, 20.0}}};
constexpr std::array<TubePoint, 2> kGroove = {{{{-5, -20, 0}, 2.0}, {{5, -20, 0}, 2.0}}};
constexpr std::array<TubeRow, 1> kRough = {{{"ball", TubeRow::Tool::add, false, 0.0, kBall}}};
constexpr std::array<TubeRow, 1> kCarved = {
    {{"groove", TubeRow::Tool::carve, false, 0.5, kGroove}}};

TEST(SkinShape, ADabBringsTheSkinForwardOnBothSides) {
  constexpr std::array<Dab, 1> kDabs = {{{{20, 0, 0}, 10.0, 2.0}}};
  const SkinShape shape(kRough, kDabs, {}, -100.0);
  EXPECT_NEAR(shape.distance_mm({20, 0, 0}), -2.0, 1e-12);
  EXPECT_NEAR(shape.distance_mm({-20, 0, 0}), -2.0, 1e-12);
  EXPECT_NEAR(shape.distance_mm({0, 20, 0}), 0.0, 1e-12);
  // (1 - 0.2^2)^3 of the height at a fifth of the radius
  EXPECT_NEAR(shape.distance_mm({22, 0, 0}), 2.0 - 2.0 * 0.96 * 0.96 * 0.96, 1e-12);
}

TEST(SkinShape, AFeatureCarvesAndThePlaneCutsTheNeck) {
  const SkinShape shape(kRough, {}, kCarved, -10.0);
  EXPECT_GT(shape.distance_mm({0, -19, 0}), 0.5);
  EXPECT_NEAR(shape.distance_mm({0, 0, -12}), 2.0, 1e-12);
  EXPECT_NEAR(shape.bounds().min().z(), -10.0, 1e-12);
}

TEST(SkinShape, OnesNearABallAgreeWithTheWhole) {
  const auto skin = skin_solid();
  Random random(5);
  for (int i = 0; i < 40; ++i) {
    const Vector3d center(random.uniform(-90, 90), random.uniform(-125, 110),
                          random.uniform(-120, 125));
    const auto near = skin->near_ball(center, 6.0, 3.0);
    for (int k = 0; k < 20; ++k) {
      const Vector3d step(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
      const double whole = skin->distance_mm(center + step);
      const double part = near->distance_mm(center + step);
      EXPECT_EQ(whole < 0.0, part < 0.0);
      if (std::abs(whole) < 3.0) {
        EXPECT_NEAR(whole, part, 0.01);
      }
    }
  }
}

}  // namespace
}  // namespace skullstation
