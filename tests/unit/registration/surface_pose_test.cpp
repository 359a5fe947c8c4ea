#include "reconstruction/registration/surface_pose.h"

#include <gtest/gtest.h>

#include "core/units.h"
#include "reconstruction/phantom/person.h"
#include "tests/unit/registration/skull_pieces.h"

namespace skullstation {
namespace {

struct TwoSkulls {
  Person average;
  Person other;  // vertices correspond
};

const TwoSkulls& skulls() {
  static const TwoSkulls made = [] {
    const PersonMaker maker(3.0, 0);
    return TwoSkulls{maker.make(average_person(Sex::male), 0), maker.make(draw_person(77), 0)};
  }();
  return made;
}

struct Turn {
  double angle_deg;
  double shift_mm;  // in the middle of the points
};

/// How far a pose is from the one that lays the triangles of `part`, a part of the other's skull,
/// best onto the same triangles of the average one's.
Turn error_of(const Similarity3& average_from_other, const TriangleMesh& part) {
  Points3 own(part.triangles.rows(), 3);
  Points3 average(own.rows(), 3);
  for (Eigen::Index t = 0; t < own.rows(); ++t) {
    own.row(t) = part.vertices.row(part.triangles(t, 0));
    average.row(t) = skulls().average.skull.vertices.row(part.triangles(t, 0));
  }
  const auto truth = fit_similarity(own, average, {}, FitScale::symmetric);
  if (!truth) return {180.0, 1000.0};
  const Eigen::Vector3d middle = own.colwise().mean().transpose();
  return {degrees(average_from_other.rotation.angularDistance(truth->rotation)),
          (average_from_other * middle - *truth * middle).norm()};
}

Turn found_and_true(const TriangleMesh& part, std::uint64_t seed) {
  Random random(seed);
  const Similarity3 pose = random_pose(random, 300.0);
  const auto found = find_surface_pose(skulls().average.skull, moved(pose, part), {});
  EXPECT_TRUE(found) << found.error().message();
  return found ? error_of(found->inverse() * pose, part) : Turn{180.0, 1000.0};
}

TEST(SurfacePose, AnotherPersonsSkullIsFoundInAnyPose) {
  const Turn error = found_and_true(skulls().other.skull, 1);
  EXPECT_LT(error.angle_deg, 3.0);
  EXPECT_LT(error.shift_mm, 3.0);
}

TEST(SurfacePose, SoIsWhatIsLeftOfIt) {
  // Without its face a skull is little but a round vault, which slides about in another.
  const Eigen::Vector3d face = -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d base = -Eigen::Vector3d::UnitZ();
  std::uint64_t seed = 2;
  for (const Eigen::Vector3d& lost :
       {face, Eigen::Vector3d(face + base), base, Eigen::Vector3d(-face),
        Eigen::Vector3d(Eigen::Vector3d::UnitX()), Eigen::Vector3d(-base)}) {
    const Turn error = found_and_true(broken(skulls().other.skull, lost.normalized(), 0.4), seed++);
    EXPECT_LT(error.angle_deg, 5.0) << lost.transpose();
    EXPECT_LT(error.shift_mm, 5.0) << lost.transpose();
  }
}

TEST(SurfacePose, TheSameForAnyNumberOfThreads) {
  const TriangleMesh& other = skulls().other.skull;
  const auto one = find_surface_pose(skulls().average.skull, other, {.threads = 1});
  const auto three = find_surface_pose(skulls().average.skull, other, {.threads = 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->matrix(), three->matrix());
}

}  // namespace
}  // namespace skullstation
