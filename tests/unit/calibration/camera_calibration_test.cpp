#include "capture/calibration/camera_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/random.h"
#include "tests/unit/calibration/board_picture.h"

namespace skullstation {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

CharucoBoard board_in_hand() {
  CharucoBoard board;
  board.squares_x = 10;
  board.squares_y = 8;
  return board;
}

Lens random_lens(Random& random) {
  const double focal = random.uniform(1500.0, 3500.0);
  return Lens::from_params(
      1600, 1200, LensModel::opencv,
      {focal, focal * random.uniform(0.998, 1.002), 800.0 + random.normal(0.0, 10.0),
       600.0 + random.normal(0.0, 10.0), random.uniform(-0.25, 0.1), random.uniform(-0.05, 0.1),
       random.normal(0.0, 5e-4), random.normal(0.0, 5e-4)});
}

Lens some_lens() {
  Random random(11);
  return random_lens(random);
}

std::vector<CalibrationView> seen_from(const std::vector<Rigid3>& poses, const Lens& lens,
                                       double noise_px, std::uint64_t seed) {
  const CharucoBoard board = board_in_hand();
  Random random(seed);
  std::vector<CalibrationView> views;
  for (const Rigid3& pose : poses) {
    CalibrationView& view = views.emplace_back();
    view.name = "view " + std::to_string(views.size());
    for (int id = 0; id < board.corner_count(); ++id) {
      const Eigen::Vector2d px = lens.project(pose * board.corner(id));
      const Eigen::Vector2d noise(random.normal(0.0, noise_px), random.normal(0.0, noise_px));
      const bool inside =
          px.x() > 3.0 && px.y() > 3.0 && px.x() < lens.width - 3.0 && px.y() < lens.height - 3.0;
      if (inside) view.corners.push_back({id, px + noise});
    }
  }
  return views;
}

std::vector<CalibrationView> good_views(const Lens& lens, double noise_px = 0.03,
                                        std::uint64_t seed = 1) {
  const double distance_mm = filling_distance_mm(board_in_hand(), lens);
  return seen_from(calibration_poses(lens, distance_mm), lens, noise_px, seed);
}

Result<CameraCalibrationReport> calibrate(const std::vector<CalibrationView>& views,
                                          const CameraCalibrationOptions& options = {}) {
  return calibrate_camera(views, board_in_hand(), 1600, 1200, options);
}

std::string failure(const Result<CameraCalibrationReport>& result, ErrorKind kind) {
  EXPECT_FALSE(result);
  if (result) return {};
  EXPECT_EQ(result.error().kind, kind);
  return result.error().message();
}

/// RMS distance over the image between what the two lenses make of the same rays, after the
/// rotation of the camera that makes it least: that much no calibration can tell from its pose.
double lens_difference_px(const Lens& truth, const Lens& found) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector2d>> rays;
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (double y = 0.02 * truth.height; y < truth.height; y += 0.08 * truth.height) {
    for (double x = 0.02 * truth.width; x < truth.width; x += 0.08 * truth.width) {
      const Eigen::Vector2d px(x, y);
      const Eigen::Vector3d ray = truth.ray(px)->normalized();
      correlation += found.ray(px)->normalized() * ray.transpose();
      rays.emplace_back(ray, px);
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  double sum = 0.0;
  for (const auto& [ray, px] : rays) sum += (found.project(rotation * ray) - px).squaredNorm();
  return std::sqrt(sum / static_cast<double>(rays.size()));
}

void expect_near_truth(const Lens& found, const Lens& truth) {
  EXPECT_NEAR(found.fx / truth.fx, 1.0, 1e-3);
  EXPECT_NEAR(found.fy / truth.fy, 1.0, 1e-3);
  EXPECT_NEAR(found.cx, truth.cx, 1.0);
  EXPECT_NEAR(found.cy, truth.cy, 1.0);
  EXPECT_LT(lens_difference_px(truth, found), 0.1);
}

TEST(CameraCalibration, ExactWithoutNoise) {
  const Lens lens = some_lens();
  const auto report = calibrate(good_views(lens, 0.0));
  ASSERT_TRUE(report) << report.error().message();
  const auto truth = lens.params(LensModel::opencv);
  const auto found = report->calibration.lens.params(LensModel::opencv);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(found[i], truth[i], 1e-3);
  for (std::size_t i = 4; i < 8; ++i) EXPECT_NEAR(found[i], truth[i], 1e-6);
  EXPECT_LT(report->calibration.rms_px, 1e-5);
}

TEST(CameraCalibration, MeetsItsTargetWithStandardErrorsThatAreTrue) {
  constexpr int seeds = 12;
  std::vector<double> squared(8, 0.0);
  for (int seed = 0; seed < seeds; ++seed) {
    Random random(mix(7, static_cast<std::uint64_t>(seed)));
    const Lens lens = random_lens(random);
    const auto report = calibrate(good_views(lens, 0.03, random.bits()));
    ASSERT_TRUE(report) << report.error().message();
    const CameraCalibration& found = report->calibration;
    expect_near_truth(found.lens, lens);
    EXPECT_EQ(found.views, 20);
    EXPECT_NEAR(found.rms_px, 0.03 * std::sqrt(2.0), 0.005);
    ASSERT_EQ(found.standard_errors.size(), 8U);
    for (std::size_t i = 0; i < 8; ++i) {
      const double error =
          found.lens.params(LensModel::opencv)[i] - lens.params(LensModel::opencv)[i];
      squared[i] += std::pow(error / found.standard_errors[i], 2) / seeds;
    }
  }
  // Each sum over the seeds is chi-square of 12: within these limits but once in some thousands.
  for (const double mean : squared) {
    EXPECT_GT(mean, 0.15);
    EXPECT_LT(mean, 3.0);
  }
}

TEST(CameraCalibration, FromPicturesOfTheBoard) {
  const CharucoBoard board = board_in_hand();
  const Lens lens = Lens::from_params(640, 480, LensModel::opencv,
                                      {1120.0, 1118.0, 326.1, 235.7, -0.16, 0.09, 0.0007, -0.0004});
  std::vector<CalibrationView> views;
  auto poses = calibration_poses(lens, filling_distance_mm(board, lens));
  poses.resize(14);
  for (const Rigid3& pose : poses) {
    testing::BoardPicture picture;
    picture.lens = lens;
    picture.camera_from_board = pose;
    picture.noise_sd = 1.5;
    picture.samples = 3;
    const Image8 image = testing::photograph(picture, board, views.size());
    views.push_back({"view " + std::to_string(views.size() + 1), detect_board(image, board)});
  }
  const auto report = calibrate_camera(views, board, lens.width, lens.height);
  ASSERT_TRUE(report) << report.error().message();
  expect_near_truth(report->calibration.lens, lens);
  EXPECT_LT(report->calibration.rms_px, 0.05);
}

TEST(CameraCalibration, LongAndShortLensesNeedNoStartValue) {
  for (const double focal : {800.0, 12000.0}) {
    const Lens lens = Lens::from_params(1600, 1200, LensModel::opencv,
                                        {focal, focal, 790.0, 610.0, -0.02, 0.0, 0.0, 0.0});
    CameraCalibrationOptions options;
    options.max_focal_error_percent = 1.0;  // a long lens sees little perspective
    const auto report = calibrate(good_views(lens, 0.02), options);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_NEAR(report->calibration.lens.fx / focal, 1.0, 5e-3);
  }
}

TEST(CameraCalibration, BadViewsAndCornersAreLeftOutAndNamed) {
  const Lens lens = some_lens();
  auto views = good_views(lens);
  for (BoardCorner& corner : views[4].corners) {  // the board bent while this one was taken
    corner.position_px.x() += 2.0 * std::sin(0.004 * corner.position_px.y());
  }
  views[9].corners.resize(7);
  views[12].corners.clear();
  views[15].corners[3].position_px += Eigen::Vector2d(4.0, -3.0);
  const auto report = calibrate(views);
  ASSERT_TRUE(report) << report.error().message();
  expect_near_truth(report->calibration.lens, lens);
  EXPECT_EQ(report->calibration.views, 17);
  EXPECT_THAT(report->views[4].left_out, HasSubstr("contradict"));
  EXPECT_THAT(report->views[9].left_out, HasSubstr("only 7 corners"));
  EXPECT_THAT(report->views[12].left_out, HasSubstr("board was not found"));
  EXPECT_EQ(report->views[15].left_out, "");
  EXPECT_LT(report->calibration.rms_px, 0.05);
}

TEST(CameraCalibration, TooFewViewsAreRefusedWithTheReason) {
  auto views = good_views(some_lens());
  views.resize(9);
  views[2].corners.clear();
  views[5].corners.resize(5);
  EXPECT_THAT(
      failure(calibrate(views), ErrorKind::no_result),
      AllOf(HasSubstr("7 of 9 views can be used, 8 are needed"),
            HasSubstr("view 3: the board was not found"), HasSubstr("view 6: only 5 corners")));
  EXPECT_THAT(failure(calibrate({}), ErrorKind::no_result), HasSubstr("0 of 0 views"));
}

TEST(CameraCalibration, FrontalViewsAreRefused) {
  const Lens lens = some_lens();
  const double distance_mm = filling_distance_mm(board_in_hand(), lens);
  auto poses = calibration_poses(lens, distance_mm);
  const Eigen::Quaterniond facing(0.0, 1.0, 0.0, 0.0);
  for (Rigid3& pose : poses) pose.rotation = facing;
  EXPECT_THAT(
      failure(calibrate(seen_from(poses, lens, 0.03, 3)), ErrorKind::no_result),
      AllOf(HasSubstr("only 0 of 20 views look at the board aslant"), HasSubstr("tilt the board")));
}

TEST(CameraCalibration, TiltsAboutOneAxisAreRefused) {
  const Lens lens = some_lens();
  const double distance_mm = filling_distance_mm(board_in_hand(), lens);
  auto poses = calibration_poses(lens, distance_mm);
  const Eigen::Quaterniond facing(0.0, 1.0, 0.0, 0.0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double tilt = (i % 2 == 0 ? 0.5 : -0.4) + 0.01 * static_cast<double>(i);
    poses[i].rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()) * facing;
  }
  EXPECT_THAT(failure(calibrate(seen_from(poses, lens, 0.03, 3)), ErrorKind::no_result),
              HasSubstr("about nearly the same axis"));
}

TEST(CameraCalibration, UncoveredImageIsRefused) {
  const Lens lens = some_lens();
  const double distance_mm = 2.5 * filling_distance_mm(board_in_hand(), lens);
  auto poses = calibration_poses(lens, distance_mm);
  for (Rigid3& pose : poses) pose.translation.head<2>() *= 0.2;
  CameraCalibrationOptions options;
  options.max_focal_error_percent = 10.0;
  EXPECT_THAT(failure(calibrate(seen_from(poses, lens, 0.03, 3), options), ErrorKind::no_result),
              AllOf(HasSubstr("of the image"), HasSubstr("into the corners")));
}

TEST(CameraCalibration, UncertainFocalLengthIsRefused) {
  auto views = good_views(some_lens(), 0.45);
  views.resize(8);
  EXPECT_THAT(failure(calibrate(views), ErrorKind::no_result),
              HasSubstr("focal length is known to"));
}

TEST(CameraCalibration, BentBoardIsRefused) {
  const Lens lens = some_lens();
  const CharucoBoard board = board_in_hand();
  std::vector<CalibrationView> views;
  for (const Rigid3& pose : calibration_poses(lens, filling_distance_mm(board, lens))) {
    CalibrationView& view = views.emplace_back();
    view.name = "view";
    for (int id = 0; id < board.corner_count(); ++id) {
      Eigen::Vector3d x = board.corner(id);
      x.z() = 6.0 * std::cos(0.02 * x.x());  // a sheet of paper held by its edges
      view.corners.push_back({id, lens.project(pose * x)});
    }
  }
  EXPECT_THAT(failure(calibrate(views), ErrorKind::no_result),
              AllOf(HasSubstr("flat"), Not(HasSubstr("aslant"))));
}

TEST(CameraCalibration, SenselessInputIsRefused) {
  const auto views = good_views(some_lens());
  const CharucoBoard board = board_in_hand();
  EXPECT_THAT(failure(calibrate_camera(views, board, 0, 1200), ErrorKind::bad_input),
              HasSubstr("0 x 1200"));
  auto broken = views;
  broken[3].corners[0].id = 5000;
  EXPECT_THAT(failure(calibrate(broken), ErrorKind::bad_input),
              AllOf(HasSubstr("view 4"), HasSubstr("5000")));
  broken = views;
  broken[3].corners[0].id = broken[3].corners[1].id;
  EXPECT_THAT(failure(calibrate(broken), ErrorKind::bad_input), HasSubstr("twice"));
  CharucoBoard impossible = board;
  impossible.marker_mm = 30.0;
  EXPECT_THAT(failure(calibrate_camera(views, impossible, 1600, 1200), ErrorKind::bad_input),
              HasSubstr("smaller than"));
  CameraCalibrationOptions options;
  options.min_views = 1;
  EXPECT_THAT(failure(calibrate(views, options), ErrorKind::bad_input), HasSubstr("options"));
}

TEST(CameraCalibration, SquareSizeHasNoSay) {
  const Lens lens = some_lens();
  const auto views = good_views(lens);
  CharucoBoard larger = board_in_hand();
  larger.square_mm *= 1.07;
  larger.marker_mm *= 1.07;
  const auto a = calibrate(views);
  const auto b = calibrate_camera(views, larger, 1600, 1200);
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->calibration.lens.fx, b->calibration.lens.fx, 1e-3);
  EXPECT_NEAR(a->calibration.lens.k1, b->calibration.lens.k1, 1e-6);
}

TEST(CalibrationPoses, AreVariedAndShowMostOfTheBoard) {
  const Lens lens = some_lens();
  const CharucoBoard board = board_in_hand();
  const auto poses = calibration_poses(lens, filling_distance_mm(board, lens));
  EXPECT_EQ(poses.size(), 20U);
  for (const Rigid3& pose : poses) {
    const Eigen::Vector3d normal = pose.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_LT(normal.dot(pose.translation), 0.0);  // the printed side is to the camera
    int visible = 0;
    for (int id = 0; id < board.corner_count(); ++id) {
      const Eigen::Vector2d px = lens.project(pose * board.corner(id));
      visible += px.x() > 0 && px.y() > 0 && px.x() < 1600 && px.y() < 1200 ? 1 : 0;
    }
    EXPECT_GT(visible, board.corner_count() * 2 / 5);
  }
}

}  // namespace
}  // namespace skullstation
