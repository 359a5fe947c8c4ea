#include "reconstruction/photogrammetry/poses_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "core/session/image_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/photogrammetry/poses_scene.h"

namespace skullstation {
namespace {

using skullstation::testing::make_pose_scene;
using skullstation::testing::PoseSceneTruth;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

/// A session of the scene: the true lenses, no board, no poses.
Session session_of(const PoseSceneTruth& truth) {
  Session session;
  for (const PoseCamera& camera : truth.cameras) {
    SessionCamera& added = session.cameras.emplace_back();
    added.id = camera.id;
    added.width = camera.width;
    added.height = camera.height;
    added.model = LensModel::opencv;
    added.params = camera.lens->params(LensModel::opencv);
  }
  for (const PoseObservation& view : truth.views) {
    SessionView& added = session.views.emplace_back();
    added.image = view.name;
    added.camera = session.cameras[static_cast<std::size_t>(view.camera)].id;
    added.pass = view.pass;
    added.table_angle_deg = view.table_angle_deg;
  }
  return session;
}

class SessionPoses : public ::testing::Test {
 protected:
  Result<PoseResult> find(PoseMethod method = PoseMethod::automatic) {
    std::vector<PoseObservation> observations = truth_.views;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      observations[i].given = session_.views[i].camera_from_table;
      if (!session_.board) observations[i].corners.clear();
    }
    PoseOptions options;
    options.method = method;
    options.motion.colmap = "/nowhere/colmap";
    return find_poses(session_, photographs_, observations, options);
  }

  PoseSceneTruth truth_ = make_pose_scene({});
  Session session_ = session_of(truth_);
  std::vector<Image8> photographs_{truth_.views.size(), Image8(32, 24, 1)};
};

TEST_F(SessionPoses, TheBoardComesFirst) {
  session_.board = truth_.board;
  const auto found = find();
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->scale, ScaleSource::board);
}

TEST_F(SessionPoses, GivenPosesAreTakenAsTheyAreAndViewsWithoutAreNamed) {
  for (std::size_t i = 0; i < session_.views.size(); ++i) {
    if (i != 4) session_.views[i].camera_from_table = truth_.camera_from_table[i];
  }
  const auto found = find();
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->scale, ScaleSource::given_poses);
  EXPECT_EQ(found->lenses.size(), session_.cameras.size());
  for (std::size_t i = 0; i < found->views.size(); ++i) {
    if (i == 4) {
      EXPECT_THAT(found->views[i].dropped, HasSubstr("camera_from_table"));
      continue;
    }
    EXPECT_TRUE(found->views[i].used());
    EXPECT_EQ(found->views[i].camera_from_table.matrix(), truth_.camera_from_table[i].matrix());
  }
}

TEST_F(SessionPoses, TwoGivenPosesAreTooFew) {
  for (std::size_t i = 0; i < 2; ++i) {
    session_.views[i].camera_from_table = truth_.camera_from_table[i];
  }
  const auto found = find(PoseMethod::given);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::no_result);
  EXPECT_THAT(found.error().what, HasSubstr("3 are needed"));
}

TEST_F(SessionPoses, GivenPosesWithoutALensAreOfNoUse) {
  for (std::size_t i = 0; i < session_.views.size(); ++i) {
    session_.views[i].camera_from_table = truth_.camera_from_table[i];
  }
  session_.cameras[1].params.reset();
  const auto found = find();
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(found.error().where, HasSubstr(session_.cameras[1].id));
}

TEST_F(SessionPoses, TheBoardIsAskedForWhereThereIsNone) {
  const auto found = find(PoseMethod::board);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(found.error().what, HasSubstr("no board"));
}

TEST_F(SessionPoses, WithNeitherBoardNorPosesColmapIsAsked) {
  const auto found = find();
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(found.error().where, HasSubstr("/nowhere/colmap"));
  EXPECT_THAT(found.error().advice, HasSubstr("install"));
}

TEST_F(SessionPoses, APassOfTwoViewsIsTooLittleForMotion) {
  for (std::size_t i = 2; i < truth_.views.size(); ++i) truth_.views[i].pass = 1;
  const auto found = find(PoseMethod::motion);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::no_result);
  EXPECT_THAT(found.error().message(), HasSubstr("has 2 views, 3 are needed"));
}

class Photographs : public ::testing::Test {
 protected:
  Photographs() {
    session_.cameras.resize(1);
    session_.cameras[0].id = "cam0";
    session_.cameras[0].width = 32;
    session_.cameras[0].height = 24;
    session_.views.resize(1);
    session_.views[0].image = "a.png";
    session_.views[0].camera = "cam0";
  }
  void write(const Image8& image) {
    ASSERT_TRUE(write_file_durably(folder_ / "a.png", encode_png(image)));
  }
  TemporaryFolder folder_;
  Session session_;
};

TEST_F(Photographs, AreReadInTheirOrder) {
  write(Image8(32, 24, 1, 7));
  const auto read = read_photographs(session_, folder_.path(), 1);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->size(), 1U);
  EXPECT_EQ(read->front().at(3, 3), 7);
}

TEST_F(Photographs, AMissingOneIsNamed) {
  const auto read = read_photographs(session_, folder_.path(), 1);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(read.error().where, HasSubstr("a.png"));
}

TEST_F(Photographs, OneOfAnotherSizeIsNamed) {
  write(Image8(24, 32, 1));
  const auto read = read_photographs(session_, folder_.path(), 1);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().what, HasSubstr("24 x 32"));
}

TEST_F(Photographs, ADamagedOneIsNamed) {
  write(Image8(32, 24, 1));
  session_.views[0].sha256 = std::string(64, '0');
  const auto read = read_photographs(session_, folder_.path(), 1);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(read.error().where, HasSubstr("a.png"));
}

TEST_F(Photographs, ReadingStopsWhenAsked) {
  write(Image8(32, 24, 1));
  std::stop_source stop;
  stop.request_stop();
  const auto read = read_photographs(session_, folder_.path(), 1,
                                     Progress{[](double, std::string_view) {}, stop.get_token()});
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
