#include "core/transform.h"

#include <gtest/gtest.h>

#include "core/units.h"

namespace skullstation {
namespace {

Rigid3 example() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized())),
          Eigen::Vector3d(4, -5, 6)};
}

TEST(Rigid3, TheInverseUndoesIt) {
  const Eigen::Vector3d x(7, 8, 9);
  EXPECT_LT((example().inverse() * (example() * x) - x).norm(), 1e-12);
  EXPECT_LT(((example().inverse() * example()).matrix() - Eigen::Matrix4d::Identity()).norm(),
            1e-12);
}

TEST(Rigid3, ComposesLikeMatrices) {
  const Rigid3 a = example();
  const Rigid3 b = rotation_about_z(30) * a.inverse();
  EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-12);
}

TEST(Rigid3, IsReadBackFromItsMatrix) {
  const Rigid3 back = Rigid3::from_matrix(example().matrix().topRows<3>());
  EXPECT_LT((back.matrix() - example().matrix()).norm(), 1e-12);
}

TEST(Similarity3, TheInverseUndoesItAndComposesLikeMatrices) {
  const Similarity3 a{2.5, example().rotation, example().translation};
  const Similarity3 b{0.3, rotation_about_z(77).rotation, Eigen::Vector3d(1, 1, 2)};
  EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-12);
  EXPECT_LT(((a.inverse() * a).matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
}

TEST(RotationAboutZ, IsCounterClockwiseSeenFromAbove) {
  EXPECT_LT((rotation_about_z(90) * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(),
            1e-12);
}

TEST(RotationDistance, IsTheAngleBetween) {
  EXPECT_NEAR(rotation_distance_deg(rotation_about_z(350), rotation_about_z(20)), 30.0, 1e-9);
}

TEST(Units, TurnsTakeTheShortWay) {
  EXPECT_DOUBLE_EQ(turn_deg(350, 10), 20);
  EXPECT_DOUBLE_EQ(turn_deg(10, 350), -20);
  EXPECT_DOUBLE_EQ(turn_deg(0, 180), -180);
  EXPECT_DOUBLE_EQ(wrapped_deg(-90), 270);
  EXPECT_DOUBLE_EQ(wrapped_deg(720), 0);
}

}  // namespace
}  // namespace skullstation
