#include "reconstruction/photogrammetry/poses_join.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {
namespace {

/// The part of a surface whose triangles the predicate keeps, its vertices moved.
template <class Keep>
TriangleMesh part_of(const TriangleMesh& mesh, const Rigid3& place, double noise_mm,
                     std::uint64_t seed, const Keep& keep) {
  Random random(seed);
  TriangleMesh part;
  part.vertices.resize(mesh.vertices.rows(), 3);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    part.vertices.row(v) =
        (place * mesh.vertices.row(v).transpose() + noise_mm * noise).transpose();
  }
  std::vector<Eigen::RowVector3i> kept;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::RowVector3d middle =
        (mesh.vertices.row(mesh.triangles(t, 0)) + mesh.vertices.row(mesh.triangles(t, 1)) +
         mesh.vertices.row(mesh.triangles(t, 2))) /
        3.0;
    if (keep(middle)) kept.push_back(mesh.triangles.row(t));
  }
  part.triangles.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t t = 0; t < kept.size(); ++t) {
    part.triangles.row(static_cast<Eigen::Index>(t)) = kept[t];
  }
  return part;
}

class JoinPasses : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { skull_ = canonical_skull(3.0, 0); }

  /// What the upright pass sees: all but the underside.
  static TriangleMesh upright() {
    return part_of(skull_, Rigid3{}, 0.05, 1,
                   [](const Eigen::RowVector3d& x) { return x.z() > -25.0; });
  }
  /// What the pass with the specimen turned over sees: all but the top of the vault.
  static TriangleMesh turned_over(const Rigid3& place) {
    return part_of(skull_, place, 0.05, 2,
                   [](const Eigen::RowVector3d& x) { return x.z() < 50.0; });
  }
  static double worst_mm(const Rigid3& first_from_second, const Rigid3& place) {
    double worst = 0.0;
    for (Eigen::Index v = 0; v < skull_.vertices.rows(); v += 50) {
      const Eigen::Vector3d x = skull_.vertices.row(v).transpose();
      worst = std::max(worst, (first_from_second * (place * x) - x).norm());
    }
    return worst;
  }

  static inline TriangleMesh skull_;
};

TEST_F(JoinPasses, FindsTheSpecimenHoweverItWasTurnedOver) {
  const TriangleMesh first = upright();
  Random random(7);
  for (int i = 0; i < 3; ++i) {
    const Rigid3 place{
        Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
            .normalized(),
        100.0 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())};
    const auto join = join_passes(first, turned_over(place));
    ASSERT_TRUE(join) << join.error().message();
    EXPECT_LT(worst_mm(join->first_from_second, place), 0.1) << "placement " << i;
    EXPECT_GT(join->overlap, 0.5);
    EXPECT_LT(join->rms_mm, 0.2);
  }
}

TEST_F(JoinPasses, IsTheSameForAnyNumberOfThreads) {
  const Rigid3 place{Eigen::Quaterniond(Eigen::AngleAxisd(3.0, Eigen::Vector3d::UnitX())),
                     {10.0, -5.0, 80.0}};
  const TriangleMesh first = upright();
  const TriangleMesh second = turned_over(place);
  PassJoinOptions options;
  options.threads = 1;
  const auto one = join_passes(first, second, options);
  options.threads = 3;
  const auto three = join_passes(first, second, options);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->first_from_second.matrix(), three->first_from_second.matrix());
}

TEST_F(JoinPasses, RefusesSurfacesThatHaveTooLittleInCommon) {
  const TriangleMesh vault =
      part_of(skull_, Rigid3{}, 0.0, 1, [](const Eigen::RowVector3d& x) { return x.z() > 55.0; });
  const TriangleMesh base =
      part_of(skull_, Rigid3{}, 0.0, 2, [](const Eigen::RowVector3d& x) { return x.z() < -5.0; });
  const auto join = join_passes(vault, base);
  ASSERT_FALSE(join);
  EXPECT_EQ(join.error().kind, ErrorKind::no_result);
  EXPECT_THAT(join.error().advice, ::testing::HasSubstr("take more views"));
}

TEST_F(JoinPasses, RefusesAnotherSpecimen) {
  TriangleMesh other = skull_;
  other.vertices.col(1) *= 1.07;
  other.vertices.col(0) *= 0.96;
  const auto join = join_passes(upright(), other);
  ASSERT_FALSE(join) << "overlap " << join->overlap << ", rms " << join->rms_mm << " mm, runner-up "
                     << join->runner_up;
  EXPECT_EQ(join.error().kind, ErrorKind::no_result);
}

TEST_F(JoinPasses, RefusesASpecimenThatLooksTheSameFromAllSides) {
  constexpr int rings = 40;
  constexpr int sectors = 80;
  TriangleMesh ball;
  ball.vertices.resize(rings * sectors, 3);
  ball.triangles.resize(2 * (rings - 1) * sectors, 3);
  Eigen::Index row = 0;
  for (int r = 0; r < rings; ++r) {
    const double polar = std::numbers::pi * (r + 0.5) / rings;
    for (int s = 0; s < sectors; ++s) {
      const double around = 2.0 * std::numbers::pi * s / sectors;
      ball.vertices.row(r * sectors + s) << 70.0 * std::sin(polar) * std::cos(around),
          70.0 * std::sin(polar) * std::sin(around), 70.0 * std::cos(polar);
      if (r + 1 == rings) continue;
      const int a = r * sectors + s;
      const int b = r * sectors + (s + 1) % sectors;
      ball.triangles.row(row++) << a, a + sectors, b;
      ball.triangles.row(row++) << b, a + sectors, b + sectors;
    }
  }
  const auto join = join_passes(ball, ball);
  ASSERT_FALSE(join) << "runner-up " << join->runner_up;
  EXPECT_EQ(join.error().kind, ErrorKind::no_result);
}

TEST_F(JoinPasses, RefusesAnEmptySurface) {
  const auto join = join_passes(upright(), TriangleMesh{});
  ASSERT_FALSE(join);
  EXPECT_EQ(join.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace skullstation
