#include "reconstruction/approximation/head_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "reconstruction/approximation/sphere_contacts.h"
#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(HeadResidual, FollowsWhatIsCertainAndRunsOutWhereNothingIsWanted) {
  const TriangleMesh head = testing::sphere(60.0, 4);
  std::vector<WantedShift> wanted(static_cast<std::size_t>(head.vertices.rows()));
  for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
    if (head.vertices(v, 2) > 0.0) wanted[static_cast<std::size_t>(v)] = {1.5, 100.0};
  }
  const VectorXd shift = residual_shift_mm(head.triangles, wanted, 2.0);
  for (Eigen::Index v = 0; v < shift.size(); ++v) {
    if (head.vertices(v, 2) > 30.0) {
      EXPECT_NEAR(shift[v], 1.5, 0.05);
    }
    if (head.vertices(v, 2) < -45.0) {
      EXPECT_NEAR(shift[v], 0.0, 0.1);
    }
  }
}

TEST(HeadResidual, UncertainWishesMoveLittle) {
  const TriangleMesh head = testing::sphere(60.0, 3);
  const std::vector<WantedShift> wanted(static_cast<std::size_t>(head.vertices.rows()),
                                        {1.0, 0.05});
  // Information 0.05 against the residual's own 0.25.
  const VectorXd shift = residual_shift_mm(head.triangles, wanted, 2.0);
  EXPECT_NEAR(shift.mean(), 0.05 / 0.30, 1e-6);
}

TEST(HeadResidual, AVertexThatDisagreesWithItsNeighboursIsSmoothed) {
  const TriangleMesh head = testing::sphere(60.0, 4);
  std::vector<WantedShift> wanted(static_cast<std::size_t>(head.vertices.rows()), {0.0, 4.0});
  wanted[100].mm = 3.0;
  EXPECT_LT(residual_shift_mm(head.triangles, wanted, 2.0)[100], 1.5);
}

class SphereContactsOnABall : public ::testing::Test {
 protected:
  SphereContactsOnABall() : bone(testing::sphere(60.0, 4)) {
    bone.normals = vertex_normals(bone);
    radius_mm = VectorXd::Constant(bone.vertices.rows(), 8.0);
    for (Eigen::Index v = 0; v < bone.vertices.rows(); ++v) {
      if (bone.vertices(v, 2) < 0.0) radius_mm[v] = std::numeric_limits<double>::quiet_NaN();
    }
  }

  TriangleMesh bone;
  VectorXd radius_mm;  ///< of the upper half
};

TEST_F(SphereContactsOnABall, TellsHowFarThePointIsFromTheNearestSphere) {
  const SphereContacts contacts(bone, radius_mm);
  const auto outside = contacts.of({0.0, 0.0, 70.0}, Vector3d::UnitZ(), radius_mm);
  ASSERT_TRUE(outside);
  EXPECT_NEAR(outside->gap_mm, 2.0, 1e-6);
  EXPECT_NEAR(outside->way.z(), 1.0, 1e-6);
  const auto inside = contacts.of({0.0, 0.0, 65.0}, Vector3d::UnitZ(), radius_mm);
  ASSERT_TRUE(inside);
  EXPECT_NEAR(inside->gap_mm, -3.0, 1e-6);
}

TEST_F(SphereContactsOnABall, NeedsAWayThatRunsOutwardsAndASphereNearby) {
  const SphereContacts contacts(bone, radius_mm);
  EXPECT_FALSE(contacts.of({0.0, 0.0, 70.0}, -Vector3d::UnitZ(), radius_mm)) << "seen from within";
  EXPECT_FALSE(contacts.of({0.0, 0.0, 50.0}, Vector3d::UnitZ(), radius_mm)) << "below the bone";
  EXPECT_FALSE(contacts.of({0.0, 0.0, 100.0}, Vector3d::UnitZ(), radius_mm)) << "too far off";
  EXPECT_FALSE(contacts.of({0.0, 0.0, -70.0}, -Vector3d::UnitZ(), radius_mm)) << "no spheres here";
}

}  // namespace
}  // namespace skullstation
