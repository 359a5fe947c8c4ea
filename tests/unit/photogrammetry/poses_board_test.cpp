#include "reconstruction/photogrammetry/poses_board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/unit/photogrammetry/poses_scene.h"

namespace skullstation {
namespace {

using skullstation::testing::make_pose_scene;
using skullstation::testing::PoseScene;
using skullstation::testing::PoseSceneTruth;
using skullstation::testing::scale_error_percent;
using skullstation::testing::worst_position_mm;
using skullstation::testing::worst_rotation_deg;
using ::testing::HasSubstr;

Result<PoseResult> solve(const PoseSceneTruth& truth) {
  return poses_from_board(truth.views, truth.cameras, truth.board);
}

TEST(BoardPoses, AreExactForExactCorners) {
  PoseScene scene;
  scene.noise_px = 0.0;
  const auto truth = make_pose_scene(scene);
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_LT(worst_position_mm(truth, *result), 0.01);
  EXPECT_LT(worst_rotation_deg(truth, *result), 0.001);
  EXPECT_EQ(result->scale, ScaleSource::board);
}

TEST(BoardPoses, AreAccurateWithNoisyCornersAndAnglesAndSayHowAccurate) {
  PoseSceneTruth truth = make_pose_scene({});
  for (PoseCamera& camera : truth.cameras) camera.refine = false;  // they are the true ones
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_LT(worst_position_mm(truth, *result), 0.1);
  EXPECT_LT(worst_rotation_deg(truth, *result), 0.01);
  EXPECT_LT(std::abs(scale_error_percent(truth, *result)), 0.05);
  EXPECT_NEAR(result->corner_noise_px, 0.05, 0.005);
  EXPECT_LT(std::abs(scale_error_percent(truth, *result)), 4.0 * result->scale_error_percent);
  double squares = 0.0;
  double predicted = 0.0;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    EXPECT_TRUE(result->views[i].used());
    const double error = (truth.camera_from_table[i].inverse().translation -
                          result->views[i].camera_from_table.inverse().translation)
                             .norm();
    squares += error * error;
    predicted += result->views[i].position_error_mm * result->views[i].position_error_mm;
  }
  // All views share the ring's errors, so the ratio is loose; its order of magnitude is not.
  EXPECT_LT(squares, 9.0 * predicted);
  EXPECT_GT(squares, predicted / 9.0);
  ASSERT_EQ(result->table.size(), 1U);
  EXPECT_FALSE(result->table[0].reversed);
  EXPECT_LT(result->table[0].departure_mm, 0.05);
  EXPECT_NEAR(result->table[0].axis_offset_mm, std::hypot(1.5, 1.1), 0.02);
}

TEST(BoardPoses, KnowTheTableBetterThanItsViewsDo) {
  // Views that see little of the board lean on their ring.
  PoseSceneTruth truth = make_pose_scene({});
  for (std::size_t i = 3; i < 6; ++i) truth.views[i].corners.resize(20);  // a row or two
  const auto with_angles = solve(truth);
  PoseSceneTruth without = truth;
  for (PoseObservation& view : without.views) view.table_angle_deg.reset();
  const auto alone = solve(without);
  ASSERT_TRUE(with_angles && alone);
  const auto error = [&](const PoseResult& result, std::size_t i, const Rigid3& frame) {
    return ((truth.camera_from_table[i] * frame).inverse().translation -
            result.views[i].camera_from_table.inverse().translation)
        .norm();
  };
  Rigid3 table_from_board;
  table_from_board.translation = {1.5, -1.1, 0.0};
  double leaning = 0.0;
  double free = 0.0;
  for (std::size_t i = 3; i < 6; ++i) {
    leaning += error(*with_angles, i, {});
    free += error(*alone, i, table_from_board);
  }
  EXPECT_LT(leaning, 0.5 * free);
}

TEST(BoardPoses, DoNotBelieveATableThatWobbles) {
  PoseScene scene;
  scene.wobble_mm = 0.5;
  const auto truth = make_pose_scene(scene);
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_GT(result->table.at(0).departure_mm, 0.25);
  EXPECT_LT(std::abs(scale_error_percent(truth, *result)), 0.2);
}

TEST(BoardPoses, TellATableThatTurnsTheOtherWay) {
  PoseSceneTruth truth = make_pose_scene({});
  for (PoseObservation& view : truth.views) view.table_angle_deg = -*view.table_angle_deg;
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_TRUE(result->table.at(0).reversed);
  EXPECT_LT(worst_position_mm(truth, *result), 0.5);
}

TEST(BoardPoses, NameAStopWhereTheTableSlipped) {
  PoseSceneTruth truth = make_pose_scene({});
  truth.views[4].table_angle_deg = *truth.views[4].table_angle_deg + 3.0;
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_TRUE(result->views[4].used());
  EXPECT_THAT(result->views[4].remark, HasSubstr("-3.0"));
  EXPECT_LT(worst_position_mm(truth, *result), 0.5) << "the pictures win over the command";
}

TEST(BoardPoses, DropAViewThatContradictsTheOthers) {
  PoseSceneTruth truth = make_pose_scene({});
  Random random(7);
  for (BoardCorner& corner : truth.views[2].corners) {  // bent or blurred by motion
    corner.position_px += Eigen::Vector2d(random.normal(0.0, 2.0), random.normal(0.0, 2.0));
  }
  truth.views[5].corners.clear();
  truth.views[9].corners.resize(4);
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_THAT(result->views[2].dropped, HasSubstr("px off"));
  EXPECT_THAT(result->views[5].dropped, HasSubstr("does not show the board"));
  EXPECT_THAT(result->views[9].dropped, HasSubstr("4 corners"));
  int used = 0;
  for (const ViewPose& view : result->views) used += view.used() ? 1 : 0;
  EXPECT_EQ(used, 21);
  EXPECT_LT(worst_position_mm(truth, *result), 0.5);
}

TEST(BoardPoses, AdjustALensThatDriftedALittle) {
  PoseSceneTruth truth = make_pose_scene({});
  for (PoseCamera& camera : truth.cameras) {
    camera.lens->fx *= 1.004;
    camera.lens->fy *= 1.004;
  }
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  for (const AdjustedLens& lens : result->lenses) {
    EXPECT_NEAR(lens.lens.fx, 2800.0, 5.0);
    EXPECT_GT(lens.focal_error_px, 0.0);
    EXPECT_LT(lens.focal_error_px, 5.0);
  }
}

TEST(BoardPoses, EstimateALensThatIsNotKnown) {
  PoseSceneTruth truth = make_pose_scene({});
  for (PoseCamera& camera : truth.cameras) camera.lens.reset();
  const auto result = solve(truth);
  ASSERT_TRUE(result) << result.error().message();
  for (const AdjustedLens& lens : result->lenses) EXPECT_NEAR(lens.lens.fx, 2800.0, 28.0);
}

TEST(BoardPoses, RefuseALensThatIsTenPercentOff) {
  for (const bool refine : {true, false}) {
    for (const double factor : {0.9, 1.1}) {
      PoseSceneTruth truth = make_pose_scene({});
      truth.cameras[1].lens->fx *= factor;
      truth.cameras[1].lens->fy *= factor;
      for (PoseCamera& camera : truth.cameras) camera.refine = refine;
      const auto result = solve(truth);
      ASSERT_FALSE(result) << "refine " << refine << ", factor " << factor;
      EXPECT_EQ(result.error().kind, ErrorKind::no_result);
      EXPECT_THAT(result.error().message(), HasSubstr("cam1"));
      EXPECT_THAT(result.error().message(), HasSubstr("focal length"));
    }
  }
}

TEST(BoardPoses, RefuseABoardWhoseSizeContradictsTheGivenPoses) {
  PoseSceneTruth truth = make_pose_scene({});
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    truth.views[i].given = truth.camera_from_table[i];
  }
  ASSERT_TRUE(solve(truth));
  truth.board.square_mm *= 1.04;
  truth.board.marker_mm *= 1.04;
  const auto result = solve(truth);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message(), HasSubstr("% larger than by the poses"));
  EXPECT_THAT(result.error().message(), HasSubstr("square_mm"));
}

TEST(BoardPoses, SayWhyThereAreNone) {
  PoseSceneTruth truth = make_pose_scene({});
  PoseSceneTruth two = truth;
  two.views.resize(2);
  EXPECT_THAT(solve(two).error().message(), HasSubstr("2 of 2 views can be used, 3 are needed"));
  PoseSceneTruth black = truth;
  for (PoseObservation& view : black.views) view.corners.clear();
  EXPECT_THAT(solve(black).error().message(), HasSubstr("none of the 24 views shows the board"));
  EXPECT_EQ(solve(black).error().kind, ErrorKind::no_result);
  truth.views[3].camera = 2;
  EXPECT_EQ(solve(truth).error().kind, ErrorKind::bad_input);
  truth = make_pose_scene({});
  truth.views[3].corners[0].id = 169;
  EXPECT_EQ(solve(truth).error().kind, ErrorKind::bad_input);
  BoardPoseOptions options;
  options.least_corners = 3;
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace skullstation
