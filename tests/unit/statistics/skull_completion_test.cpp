#include "reconstruction/statistics/skull_completion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/statistics/test_surfaces.h"

namespace skullstation {
namespace {

/// A ball of 80 mm, some 2,400 vertices.
const SkullTemplate& ball() {
  static const SkullTemplate made = [] {
    SkullTemplate skull;
    const TriangleMesh surface = testing::sphere(80.0, 40, 60);
    skull.vertices = surface.vertices;
    skull.boundary = surface.triangles;
    skull.boundary_count = static_cast<int>(skull.vertices.rows());
    skull.outer.assign(static_cast<std::size_t>(skull.boundary_count), true);
    return skull;
  }();
  return made;
}

/// Balls differ in width alone, by 5 % in a standard deviation.
const ShapeModel& model() {
  static const ShapeModel made = [] {
    Points3 wider = Points3::Zero(ball().vertices.rows(), 3);
    wider.col(0) = 0.05 * ball().vertices.col(0);
    return shape_model_of(flattened(ball().vertices), flattened(wider), 0.01);
  }();
  return made;
}

Points3 wide() {
  Points3 skull = ball().vertices;
  skull.col(0) *= 1.0 + 1.5 * 0.05;
  return skull;
}

/// Somebody wider than most, with a dent that the model does not know: 3 mm deep, some centimetres
/// wide, round the top.
Points3 dented() {
  Points3 skull = wide();
  for (Eigen::Index v = 0; v < skull.rows(); ++v) {
    const Eigen::Vector3d at = ball().vertices.row(v);
    const double away = (at - Eigen::Vector3d(0.0, 0.0, 80.0)).norm();
    skull.row(v) *= 1.0 - 3.0 / 80.0 * std::exp(-0.5 * away * away / 2500.0);
  }
  return skull;
}

bool on_top(int v) { return ball().vertices(v, 2) > 68.0; }

TEST(SkullCompletion, GoesOnAsTheBoneAroundItDoes) {
  const Points3 truth = dented();
  Points3 fitted = truth;
  std::vector<bool> observed(static_cast<std::size_t>(ball().boundary_count), true);
  for (int v = 0; v < ball().boundary_count; ++v) {
    if (!on_top(v)) continue;
    observed[static_cast<std::size_t>(v)] = false;
    fitted.row(v) *= 0.8;  // nonsense where nothing was seen
  }
  const CompletedSkull completed = completed_skull(ball(), model(), fitted, observed);
  double worst = 0.0;
  double worst_of_modes = 0.0;
  for (int v = 0; v < ball().boundary_count; ++v) {
    if (!on_top(v)) {
      EXPECT_EQ(completed.vertices.row(v), truth.row(v));
      EXPECT_EQ(completed.sd_mm[v], 0.0);
      continue;
    }
    worst = std::max(worst, (completed.vertices.row(v) - truth.row(v)).norm());
    worst_of_modes = std::max(worst_of_modes, (wide().row(v) - truth.row(v)).norm());
    EXPECT_GT(completed.sd_mm[v], 0.1);
    EXPECT_LT(completed.sd_mm[v], 3.0);
  }
  EXPECT_GT(worst_of_modes, 2.0);
  EXPECT_LT(worst, 1.2);
}

TEST(SkullCompletion, IsLessCertainTheFartherFromBone) {
  std::vector<bool> observed(static_cast<std::size_t>(ball().boundary_count), true);
  int edge = -1;
  int middle = 0;
  for (int v = 0; v < ball().boundary_count; ++v) {
    const double height = ball().vertices(v, 2);
    if (height <= 0.0) continue;
    observed[static_cast<std::size_t>(v)] = false;
    if (edge < 0 || height < ball().vertices(edge, 2)) edge = v;
    if (height > ball().vertices(middle, 2)) middle = v;
  }
  const CompletedSkull completed =
      completed_skull(ball(), model(), unflattened(model().mean), observed);
  EXPECT_GT(completed.sd_mm[middle], 1.5 * completed.sd_mm[edge]);
}

TEST(SkullCompletion, WithoutAnyBoneIsTheMean) {
  const std::vector<bool> nothing(static_cast<std::size_t>(ball().boundary_count), false);
  const CompletedSkull completed =
      completed_skull(ball(), model(), Points3::Zero(ball().vertices.rows(), 3), nothing);
  EXPECT_EQ(completed.vertices, unflattened(model().mean));
  EXPECT_GE(completed.sd_mm.minCoeff(), 2.0);
}

}  // namespace
}  // namespace skullstation
