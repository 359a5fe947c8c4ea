#include "reconstruction/distance/trimmed_icp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/units.h"
#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using skullstation::testing::moved;
using skullstation::testing::potato;
using skullstation::testing::sphere;

Similarity3 some_motion(double scale) {
  Similarity3 motion;
  motion.scale = scale;
  motion.rotation = Eigen::AngleAxisd(radians(12.0), Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
  motion.translation = {8.0, -5.0, 6.0};
  return motion;
}

double largest_gap_mm(const TriangleMesh& mesh, const Similarity3& a, const Similarity3& b) {
  double gap_mm = 0.0;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d point = mesh.vertices.row(v);
    gap_mm = std::max(gap_mm, (a * point - b * point).norm());
  }
  return gap_mm;
}

TEST(TrimmedIcp, FindsTheRigidMotionOfASurface) {
  const TriangleMesh mesh = potato(4);
  const Similarity3 truth = some_motion(1.0);
  const auto result = align_by_trimmed_icp(mesh, moved(mesh, truth), {});
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_TRUE(result->converged);
  EXPECT_EQ(result->b_from_a.scale, 1.0);
  EXPECT_LT(largest_gap_mm(mesh, result->b_from_a, truth), 0.01);
  EXPECT_LT(result->kept_rms_mm, 0.01);
}

TEST(TrimmedIcp, FindsAScaleEvenFarFromOne) {
  const TriangleMesh mesh = potato(4);
  TrimmedIcpOptions options;
  options.estimate_scale = true;
  for (const double scale : {0.93, 10.0}) {
    const Similarity3 truth = some_motion(scale);
    const auto result = align_by_trimmed_icp(mesh, moved(mesh, truth), options);
    ASSERT_TRUE(result) << result.error().message();
    EXPECT_NEAR(result->b_from_a.scale / scale, 1.0, 1e-4);
    EXPECT_LT(largest_gap_mm(mesh, result->b_from_a, truth), 0.01 * scale);
  }
}

TEST(TrimmedIcp, APartThatOnlyOneSurfaceHasIsTrimmedAway) {
  const TriangleMesh whole = potato(4);
  TriangleMesh part = whole;
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < whole.triangles.rows(); ++f) {
    if (whole.vertices(whole.triangles(f, 0), 2) < 45.0) {
      part.triangles.row(kept++) = whole.triangles.row(f);
    }
  }
  part.triangles.conservativeResize(kept, 3);
  const Similarity3 truth = some_motion(1.0);
  TrimmedIcpOptions options;
  options.kept_share = 0.8;
  const auto result = align_by_trimmed_icp(part, moved(whole, truth), options);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_LT(largest_gap_mm(whole, result->b_from_a, truth), 0.05);
}

TEST(TrimmedIcp, AnInnerWallThatOnlyOneSurfaceHasDoesNotPull) {
  // A scan of the upper outside of a body with a wall of 4 mm, which has half of its surface
  // inside.
  const TriangleMesh outside = potato(4);
  TriangleMesh body = outside;
  const Eigen::Index count = outside.vertices.rows();
  body.vertices.conservativeResize(2 * count, 3);
  body.vertices.bottomRows(count) = outside.vertices - 4.0 * vertex_normals(outside);
  body.triangles.conservativeResize(2 * outside.triangles.rows(), 3);
  body.triangles.bottomRows(outside.triangles.rows()) =
      (outside.triangles.rowwise().reverse().array() + static_cast<int>(count)).matrix();
  TriangleMesh scan = outside;
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < outside.triangles.rows(); ++f) {
    if (outside.vertices(outside.triangles(f, 0), 2) > -20.0) {
      scan.triangles.row(kept++) = outside.triangles.row(f);
    }
  }
  scan.triangles.conservativeResize(kept, 3);
  const Similarity3 truth = some_motion(1.0);
  const auto result = align_by_trimmed_icp(scan, moved(body, truth), {});
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_LT(largest_gap_mm(outside, result->b_from_a, truth), 0.05);
}

TEST(TrimmedIcp, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = potato(3);
  const TriangleMesh other = moved(mesh, some_motion(1.0));
  TrimmedIcpOptions options;
  options.threads = 1;
  const auto one = align_by_trimmed_icp(mesh, other, options);
  options.threads = 4;
  const auto four = align_by_trimmed_icp(mesh, other, options);
  ASSERT_TRUE(one && four);
  EXPECT_EQ(one->b_from_a.matrix(), four->b_from_a.matrix());
}

TEST(TrimmedIcp, ASphereThatMayTurnFreelyHasNoResult) {
  const TriangleMesh ball = sphere(50.0, 6);
  const auto result = align_by_trimmed_icp(ball, ball, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::no_result);
}

TEST(TrimmedIcp, BadOptionsEmptyMeshesAndCancellation) {
  TrimmedIcpOptions options;
  options.kept_share = 0.0;
  EXPECT_FALSE(align_by_trimmed_icp(potato(2), potato(2), options));
  EXPECT_FALSE(align_by_trimmed_icp(TriangleMesh{}, potato(2), {}));
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  const auto result = align_by_trimmed_icp(potato(2), potato(2), {}, progress);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
