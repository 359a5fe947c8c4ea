#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/random.h"
#include "reconstruction/photogrammetry/colmap_model.h"
#include "reconstruction/photogrammetry/poses_sfm.h"
#include "reconstruction/photogrammetry/sfm_frame.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

/// Cameras on a ring that look at (10, 20, 30), the way up of all being +z.
std::vector<Rigid3> ring(int count, double radius) {
  std::vector<Rigid3> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * i / count;
    const Eigen::Vector3d target(10.0, 20.0, 30.0);
    const Eigen::Vector3d centre =
        target + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.4);
    const Eigen::Vector3d z = (target - centre).normalized();
    const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d rotation;
    rotation.row(0) = x.transpose();
    rotation.row(1) = z.cross(x).transpose();
    rotation.row(2) = z.transpose();
    cameras.push_back({Eigen::Quaterniond(rotation), -(rotation * centre)});
  }
  return cameras;
}

TEST(SfmFrame, FindsASimilarityThoughSomeViewsAreWrong) {
  const Similarity3 truth{
      120.0, Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(), {5.0, -80.0, 33.0}};
  std::vector<FramePair> views;
  for (const Rigid3& camera : ring(12, 4.0)) {
    views.push_back({in_reference(camera, truth), camera});
  }
  views[3].camera_from_model = views[8].camera_from_model;
  const auto fit = fit_frame(views);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->reference_from_model.scale, truth.scale, 1e-9);
  EXPECT_LT((fit->reference_from_model.translation - truth.translation).norm(), 1e-6);
  EXPECT_LT(fit->reference_from_model.rotation.angularDistance(truth.rotation), 1e-9);
  EXPECT_LT(fit->scale_error_percent, 1e-6);
}

TEST(SfmFrame, TwoViewsOrOnePlaceGiveNone) {
  const Rigid3 camera = ring(4, 2.0)[0];
  EXPECT_FALSE(fit_frame({{camera, camera}, {camera, camera}}));
  EXPECT_FALSE(fit_frame({{camera, camera}, {camera, camera}, {camera, camera}}));
}

TEST(SfmFrame, OfCamerasHasItsOriginWhereTheyLookAndItsZUp) {
  const std::vector<Rigid3> cameras = ring(8, 4.0);
  const Similarity3 frame = frame_of_cameras(cameras, 1000.0);
  EXPECT_LT((frame * Eigen::Vector3d(10.0, 20.0, 30.0)).norm(), 1e-6);
  EXPECT_LT((frame.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-6);
  for (const Rigid3& camera : cameras) {
    EXPECT_NEAR(in_reference(camera, frame).inverse().translation.norm(), 1000.0, 1e-6);
  }
}

std::vector<PoseObservation> views_at(const std::vector<std::pair<int, double>>& camera_angles) {
  std::vector<PoseObservation> views;
  for (const auto& [camera, angle_deg] : camera_angles) {
    PoseObservation& view = views.emplace_back();
    view.camera = camera;
    view.table_angle_deg = angle_deg;
  }
  return views;
}

TEST(PairsToMatch, AreNeighboursByTheTablesAngle) {
  std::vector<std::pair<int, double>> rings;
  for (int camera = 0; camera < 2; ++camera) {
    for (int i = 0; i < 24; ++i) rings.emplace_back(camera, 15.0 * i);
  }
  const auto pairs = pairs_to_match(views_at(rings), std::vector<PoseCamera>(2));
  // Two neighbours on either side of its ring, three on the other.
  EXPECT_EQ(pairs.size(), 2U * 24U * 2U + 24U * 3U);
  EXPECT_TRUE(std::ranges::count(pairs, std::pair(0, 23)));  // 0 and 345 deg
  EXPECT_FALSE(std::ranges::count(pairs, std::pair(0, 12)));
}

TEST(PairsToMatch, WideStepsStillHaveNeighbours) {
  const auto pairs = pairs_to_match(
      views_at({{0, 0.0}, {0, 60.0}, {0, 120.0}, {0, 180.0}, {0, 240.0}, {0, 300.0}}),
      std::vector<PoseCamera>(1));
  EXPECT_EQ(pairs.size(), 6U);
}

TEST(PairsToMatch, WithoutAnglesAreAllWhereTheyAreFewElseThoseNearInTime) {
  std::vector<PoseObservation> views(20);
  std::vector<PoseCamera> cameras(1);
  cameras[0].width = 1600;
  cameras[0].height = 1200;
  EXPECT_EQ(pairs_to_match(views, cameras).size(), 190U);
  views.resize(100);
  const auto pairs = pairs_to_match(views, cameras);
  EXPECT_LT(pairs.size(), 1200U);
  EXPECT_TRUE(std::ranges::count(pairs, std::pair(0, 99)));  // once round
  EXPECT_TRUE(std::ranges::count(pairs, std::pair(10, 11)));
}

class ColmapText : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
  }
  void SetUp() override {
    write("cameras.txt", "# comment\n7 OPENCV 640 480 900 901 320.5 240.5 0.1 0 0 0\n");
    write("images.txt",
          "# comment\n"
          "3 1 0 0 0 0.5 0 4 7 000001.png\n10 20 5 30 40 -1\n"
          "4 0 1 0 0 0 0 5 7 000000.png\n50 60 5\n");
    write("points3D.txt", "5 1 2 3 128 128 128 0.4 3 0 4 0\n");
    images_[0].camera = images_[1].camera = 0;
  }
  Result<SfmModel> read() { return read_colmap_model(folder_.path(), images_, cameras_); }

  TemporaryFolder folder_;
  std::array<SfmImage, 3> images_;
  std::array<SfmCamera, 1> cameras_;
};

TEST_F(ColmapText, GivesCamerasLensesAndPoints) {
  const auto model = read();
  ASSERT_TRUE(model) << model.error().message();
  ASSERT_TRUE(model->camera_from_model[0] && model->camera_from_model[1]);
  EXPECT_FALSE(model->camera_from_model[2]);
  EXPECT_EQ(model->camera_from_model[1]->translation, Eigen::Vector3d(0.5, 0.0, 4.0));
  EXPECT_DOUBLE_EQ(model->camera_from_model[0]->rotation.x(), 1.0);
  EXPECT_DOUBLE_EQ(model->lenses[0].fy, 901.0);
  EXPECT_DOUBLE_EQ(model->lenses[0].k1, 0.1);
  ASSERT_EQ(model->points.size(), 1U);
  ASSERT_EQ(model->points[0].sights.size(), 2U);
  EXPECT_EQ(model->points[0].sights[0].image, 1);
  EXPECT_EQ(model->points[0].sights[1].position_px, Eigen::Vector2d(50.0, 60.0));
}

TEST_F(ColmapText, NamesFileAndLineOfWhatItCannotRead) {
  write("images.txt", "3 1 0 0 0 0.5 0 4 7 somebody.png\n\n");
  EXPECT_THAT(read().error().where, HasSubstr("images.txt:1"));
  write("cameras.txt", "7 SIMPLE_RADIAL 640 480 900 320 240 0\n");
  EXPECT_THAT(read().error().where, HasSubstr("cameras.txt:1"));
  std::filesystem::remove(folder_ / "cameras.txt");
  EXPECT_THAT(read().error().where, HasSubstr("cameras.txt"));
}

TEST_F(ColmapText, APointSeenByAStrangerIsAnError) {
  write("points3D.txt", "5 1 2 3 128 128 128 0.4 3 0 9 0\n");
  EXPECT_THAT(read().error().where, HasSubstr("points3D.txt:1"));
}

}  // namespace
}  // namespace skullstation
