#include "core/session/board_pose.h"

#include <gtest/gtest.h>

#include "tests/unit/photogrammetry/poses_scene.h"

namespace skullstation {
namespace {

using skullstation::testing::make_pose_scene;
using skullstation::testing::PoseScene;

TEST(FindBoard, GivesTheExactPoseForExactCorners) {
  PoseScene scene;
  scene.noise_px = 0.0;
  const auto truth = make_pose_scene(scene);
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    const auto found = find_board_pose(truth.views[i].corners, truth.board, *truth.cameras[0].lens);
    ASSERT_TRUE(found) << truth.views[i].name;
    EXPECT_LT(found->rms_px, 1e-6);
    // The board lies on the table, shifted by (1.5, -1.1, 0).
    const Eigen::Vector3d origin = truth.camera_from_table[i] * Eigen::Vector3d(1.5, -1.1, 0.0);
    EXPECT_LT((found->camera_from_board.translation - origin).norm(), 1e-5);
  }
}

TEST(FindBoard, ChoosesTheRightOneOfAPlanesTwoPoses) {
  // A handful of corners of a small patch: the wrong pose explains them to a fraction of a pixel.
  PoseScene scene;
  scene.noise_px = 0.0;
  const auto truth = make_pose_scene(scene);
  int checked = 0;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    std::vector<BoardCorner> patch;
    for (const BoardCorner& corner : truth.views[i].corners) {
      const int column = corner.id % 13;
      const int row = corner.id / 13;
      if (column < 3 && row < 3) patch.push_back(corner);
    }
    if (patch.size() < 9) continue;
    ++checked;
    const auto found = find_board_pose(patch, truth.board, *truth.cameras[0].lens);
    ASSERT_TRUE(found) << truth.views[i].name;
    EXPECT_LT(rotation_distance_deg(found->camera_from_board, truth.camera_from_table[i]), 0.01);
  }
  EXPECT_GT(checked, 10);
}

TEST(FindBoard, GivesNothingForTooFewCornersOrALine) {
  const auto truth = make_pose_scene({});
  const std::vector<BoardCorner>& all = truth.views[0].corners;
  EXPECT_FALSE(
      find_board_pose({all.begin(), all.begin() + 5}, truth.board, *truth.cameras[0].lens));
  std::vector<BoardCorner> line;
  for (const BoardCorner& corner : all) {
    if (corner.id / 13 == all.front().id / 13) line.push_back(corner);
  }
  ASSERT_GE(line.size(), 6U);
  EXPECT_FALSE(find_board_pose(line, truth.board, *truth.cameras[0].lens));
  EXPECT_FALSE(find_board_pose({}, truth.board, *truth.cameras[0].lens));
}

}  // namespace
}  // namespace skullstation
