#include "reconstruction/registration/point_tree.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/random.h"
#include "reconstruction/registration/oriented_point_tree.h"

namespace skullstation {
namespace {

TEST(PointTree, AgreesWithASearchOfAllPoints) {
  Random random(3);
  Points3 points(500, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = random.uniform(-10, 10);
  const PointTree tree(points);
  for (int query = 0; query < 50; ++query) {
    const Eigen::Vector3d at(random.uniform(-12, 12), random.uniform(-12, 12),
                             random.uniform(-12, 12));
    const Eigen::VectorXd squares = (points.rowwise() - at.transpose()).rowwise().squaredNorm();
    Eigen::Index nearest = 0;
    const double least = squares.minCoeff(&nearest);
    EXPECT_EQ(tree.nearest(at).index, nearest);
    EXPECT_DOUBLE_EQ(tree.nearest(at).squared_distance, least);
    EXPECT_EQ(tree.nearest(at, 0.99 * std::sqrt(least)).index, -1);
    EXPECT_EQ(tree.nearest(at, 1.01 * std::sqrt(least)).index, nearest);

    const auto within = tree.within(at, 4.0);
    EXPECT_EQ(within.size(), static_cast<std::size_t>((squares.array() < 16.0).count()));
    for (std::size_t i = 1; i < within.size(); ++i) {
      EXPECT_LE(within[i - 1].squared_distance, within[i].squared_distance);
    }
    const auto five = tree.nearest(at, 5);
    ASSERT_EQ(five.size(), 5U);
    EXPECT_EQ(five[0].index, nearest);
  }
}

TEST(OrientedPointTree, AgreesWithASearchOfAllPoints) {
  Random random(5);
  const auto direction = [&] {
    return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  };
  OrientedPoints points{Points3(400, 3), Points3(400, 3)};
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    for (int c = 0; c < 3; ++c) points.positions(i, c) = random.uniform(-40, 40);
    points.normals.row(i) = direction().transpose();
  }
  constexpr double normal_mm = OrientedPointTree::normal_mm;
  const OrientedPointTree tree(points);
  for (int query = 0; query < 50; ++query) {
    const Eigen::Vector3d at = 50.0 * direction();
    const Eigen::Vector3d normal = direction();
    const Eigen::VectorXd squares =
        (points.positions.rowwise() - at.transpose()).rowwise().squaredNorm() +
        normal_mm * normal_mm *
            (points.normals.rowwise() - normal.transpose()).rowwise().squaredNorm();
    Eigen::Index nearest = 0;
    const double least = squares.minCoeff(&nearest);
    const NearPoint found = tree.nearest(at, normal);
    EXPECT_EQ(found.index, nearest);
    EXPECT_NEAR(found.squared_distance, least, 1e-9);
  }
  EXPECT_EQ(OrientedPointTree({Points3(0, 3), Points3(0, 3)})
                .nearest(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX())
                .index,
            -1);
}

TEST(PointTree, WithoutPointsNothingIsNear) {
  const PointTree tree(Points3(0, 3));
  EXPECT_EQ(tree.nearest(Eigen::Vector3d::Zero()).index, -1);
  EXPECT_TRUE(tree.within(Eigen::Vector3d::Zero(), 5.0).empty());
}

}  // namespace
}  // namespace skullstation
