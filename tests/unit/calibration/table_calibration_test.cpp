#include "capture/calibration/table_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "capture/calibration/turn_regression.h"
#include "core/random.h"
#include "core/units.h"
#include "tests/unit/calibration/board_picture.h"

namespace skullstation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A station with everything known about it, and what its cameras see of the board.
struct SyntheticTable {
  CharucoBoard board;
  Rigid3 table_from_board;  ///< a few mm and tenths of a degree off, as laid down by hand
  std::vector<TableCamera> cameras;
  std::vector<Rigid3> camera_from_station;
  std::vector<double> commanded_deg;
  double noise_px = 0.02;
  std::uint64_t seed = 1;
  /// Where the table really stops, and how the platter is then out of place (in the station).
  std::function<double(int stop, double commanded)> true_angle = [](int, double angle_deg) {
    return angle_deg;
  };
  std::function<Rigid3(double angle_deg)> wobble = [](double) { return Rigid3{}; };

  SyntheticTable() {
    board.squares_x = 10;
    board.squares_y = 8;
    // x of the table lies along the board's x: a tilt about x then about the turned y only.
    const Eigen::Vector3d normal = Eigen::Vector3d(0.004, -0.006, 1.0).normalized();
    const Eigen::Vector3d axis_in_board(-normal.x(), -normal.y(), normal.z());
    const Eigen::Vector3d x =
        (Eigen::Vector3d::UnitX() - axis_in_board * axis_in_board.x()).normalized();
    Eigen::Matrix3d rows;
    rows.row(0) = x.transpose();
    rows.row(1) = axis_in_board.cross(x).transpose();
    rows.row(2) = axis_in_board.transpose();
    table_from_board.rotation = Eigen::Quaterniond(rows);
    table_from_board.translation = -(rows * Eigen::Vector3d(4.0, -7.0, 0.0));
    const Lens lens =
        Lens::from_params(1600, 1200, LensModel::opencv,
                          {2800.0, 2790.0, 807.3, 596.1, -0.12, 0.05, 0.0006, -0.0004});
    for (const double elevation_deg : {25.0, 50.0}) {
      cameras.push_back({"cam" + std::to_string(cameras.size()), lens});
      camera_from_station.push_back(
          testing::camera_looking_at({0.0, 0.0}, 750.0, elevation_deg, 15.0));
    }
    for (int i = 0; i < 18; ++i) commanded_deg.push_back(20.0 * i);
  }

  std::vector<TableView> views() const {
    std::vector<TableView> result;
    Random random(seed);
    for (std::size_t stop = 0; stop < commanded_deg.size(); ++stop) {
      const double angle_deg = true_angle(static_cast<int>(stop), commanded_deg[stop]);
      const Rigid3 station_from_board =
          wobble(angle_deg) * rotation_about_z(angle_deg) * table_from_board;
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        TableView view;
        view.name = cameras[c].id + " at stop " + std::to_string(stop);
        view.camera = cameras[c].id;
        view.stop = static_cast<int>(stop);
        view.commanded_deg = commanded_deg[stop];
        for (int id = 0; id < board.corner_count(); ++id) {
          const Eigen::Vector2d px = cameras[c].lens.project(
              camera_from_station[c] * (station_from_board * board.corner(id)));
          const Eigen::Vector2d noise(random.normal(0.0, noise_px), random.normal(0.0, noise_px));
          view.corners.push_back({id, px + noise});
        }
        result.push_back(std::move(view));
      }
    }
    return result;
  }

  Result<TableCalibrationReport> calibrate() const {
    return calibrate_table(views(), cameras, board);
  }
};

/// Angle between the axis as calibrated and the true one, and their distance in the board's plane,
/// both seen from the board.
double axis_error_deg(const SyntheticTable& truth, const TableCalibration& found) {
  const Eigen::Vector3d a = truth.table_from_board.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d b = found.table_from_board.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  return degrees(std::atan2(a.cross(b).norm(), a.dot(b)));
}
double axis_error_mm(const SyntheticTable& truth, const TableCalibration& found) {
  return (truth.table_from_board.inverse().translation -
          found.table_from_board.inverse().translation)
      .norm();
}

std::string failure(const Result<TableCalibrationReport>& result) {
  EXPECT_FALSE(result);
  return result ? std::string() : result.error().message();
}

TEST(TableCalibration, FindsAxisCamerasAndAngles) {
  const SyntheticTable truth;
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  const TableCalibration& found = report->calibration;
  EXPECT_LT(axis_error_deg(truth, found), 0.002);
  EXPECT_LT(axis_error_mm(truth, found), 0.005);
  EXPECT_LT(rotation_distance_deg(found.table_from_board, truth.table_from_board), 0.005);
  EXPECT_LT((found.table_from_board.translation - truth.table_from_board.translation).norm(), 0.01);
  ASSERT_EQ(found.cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(found.cameras[i].camera, truth.cameras[i].id);
    EXPECT_LT(
        rotation_distance_deg(found.cameras[i].camera_from_station, truth.camera_from_station[i]),
        0.005);
    EXPECT_LT((found.cameras[i].camera_from_station.inverse().translation -
               truth.camera_from_station[i].inverse().translation)
                  .norm(),
              0.05);
    EXPECT_NEAR(found.cameras[i].rms_px, 0.02 * std::sqrt(2.0), 0.003);
  }
  EXPECT_FALSE(found.reversed);
  EXPECT_NEAR(found.turn_ratio, 1.0, 2e-5);
  EXPECT_LT(found.angle_rms_deg, 0.003);
  EXPECT_LT(found.wobble_mm, 0.03);
  EXPECT_THAT(report->verdicts, IsEmpty());
  ASSERT_EQ(report->stops.size(), 18U);
  for (const TableStopReport& stop : report->stops) {
    EXPECT_NEAR(stop.measured_deg, stop.commanded_deg, 0.01);
  }
}

TEST(TableCalibration, ExactWithoutNoise) {
  SyntheticTable truth;
  truth.noise_px = 0.0;
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_LT(axis_error_deg(truth, report->calibration), 1e-5);
  EXPECT_LT(axis_error_mm(truth, report->calibration), 1e-5);
  EXPECT_LT(report->calibration.wobble_mm, 1e-4);
  EXPECT_NEAR(report->calibration.turn_ratio, 1.0, 1e-8);
}

TEST(TableCalibration, StandardErrorsAreThoseOfTheScatter) {
  // The reported errors are the larger half axes: over many seeds the mean square of the true
  // error lies between one and two times theirs.
  double squared_deg = 0.0;
  double squared_mm = 0.0;
  double squared_ratio = 0.0;
  constexpr int seeds = 20;
  for (int seed = 0; seed < seeds; ++seed) {
    SyntheticTable truth;
    truth.cameras.pop_back();
    truth.camera_from_station.pop_back();
    truth.commanded_deg = {0.0, 40.0, 80.0, 120.0, 160.0, 200.0, 240.0, 280.0, 320.0};
    truth.noise_px = 0.1;
    truth.seed = mix(42, static_cast<std::uint64_t>(seed));
    const auto report = truth.calibrate();
    ASSERT_TRUE(report) << report.error().message();
    const TableCalibration& found = report->calibration;
    squared_deg += std::pow(axis_error_deg(truth, found) / found.axis_error_deg, 2);
    squared_mm += std::pow(axis_error_mm(truth, found) / found.axis_error_mm, 2);
    squared_ratio += std::pow((found.turn_ratio - 1.0) / found.turn_ratio_error, 2);
  }
  EXPECT_GT(squared_deg / seeds, 0.6);
  EXPECT_LT(squared_deg / seeds, 3.0);
  EXPECT_GT(squared_mm / seeds, 0.6);
  EXPECT_LT(squared_mm / seeds, 3.0);
  EXPECT_GT(squared_ratio / seeds, 0.4);
  EXPECT_LT(squared_ratio / seeds, 2.5);
}

TEST(TableCalibration, TwoPercentSlipIsMeasuredAndNamed) {
  SyntheticTable truth;
  truth.true_angle = [](int, double angle_deg) { return 0.98 * angle_deg; };
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NEAR(report->calibration.turn_ratio, 0.98, 1e-4);
  EXPECT_LT(report->calibration.angle_rms_deg, 0.01);
  EXPECT_LT(axis_error_mm(truth, report->calibration), 0.01);
  EXPECT_THAT(report->verdicts, ElementsAre(HasSubstr("turns 2.0 % less than commanded")));
  EXPECT_THAT(report->verdicts.front(), HasSubstr("multiply steps_per_turn by 1.0204"));
}

TEST(TableCalibration, ReversedTableIsNoticed) {
  SyntheticTable truth;
  truth.true_angle = [](int, double angle_deg) { return -angle_deg; };
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->calibration.reversed);
  EXPECT_NEAR(report->calibration.turn_ratio, 1.0, 1e-4);
  EXPECT_THAT(report->verdicts, ElementsAre(HasSubstr("against the commanded direction")));
}

TEST(TableCalibration, LostStepsNowAndThenAreIrregular) {
  SyntheticTable truth;
  truth.true_angle = [](int stop, double angle_deg) {
    return angle_deg - (stop >= 6 ? 1.2 : 0.0) - (stop >= 14 ? 0.9 : 0.0);
  };
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GT(report->calibration.angle_rms_deg, 0.1);
  EXPECT_THAT(report->verdicts, Contains(HasSubstr("loses steps now and then")));
  EXPECT_THAT(report->verdicts, Not(Contains(HasSubstr("multiply steps_per_turn"))));
}

TEST(TableCalibration, OneStopOffLeavesTheRatioAlone) {
  SyntheticTable truth;
  truth.true_angle = [](int stop, double angle_deg) {
    return angle_deg + (stop == 17 ? 3.0 : 0.0);
  };
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NEAR(report->calibration.turn_ratio, 1.0, 5e-5);
  EXPECT_NEAR(report->stops.back().residual_deg, 3.0, 0.01);
}

TEST(TableCalibration, WobbleIsMeasuredAtTheRim) {
  SyntheticTable truth;
  // A platter that tilts there and back twice per turn, 0.2 deg each way.
  truth.wobble = [](double angle_deg) {
    Rigid3 tilt;
    tilt.rotation = Eigen::AngleAxisd(radians(0.2) * std::cos(2.0 * radians(angle_deg)),
                                      Eigen::Vector3d::UnitX());
    return tilt;
  };
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  // At the rim, up to 160 mm from the axis it tilts about, less what looks like a tilted board.
  EXPECT_NEAR(report->calibration.wobble_mm, 0.0035 * 160.0, 0.2);
  EXPECT_THAT(report->verdicts, Contains(HasSubstr("wobbles")));
  EXPECT_NEAR(report->calibration.turn_ratio, 1.0, 1e-3);
}

TEST(TableCalibration, OneCameraAndHalfATurnAreEnough) {
  SyntheticTable truth;
  truth.cameras.pop_back();
  truth.camera_from_station.pop_back();
  truth.commanded_deg = {0.0, 36.0, 72.0, 108.0, 144.0, 180.0};
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_LT(axis_error_mm(truth, report->calibration), 0.05);
}

TEST(TableCalibration, AnglesMayBeginAnywhereAndPassZero) {
  SyntheticTable truth;
  truth.commanded_deg.clear();
  for (int i = 0; i < 18; ++i) truth.commanded_deg.push_back(wrapped_deg(200.0 + 20.0 * i));
  const auto report = truth.calibrate();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NEAR(report->calibration.turn_ratio, 1.0, 5e-5);
  // The table's zero is the commanded zero all the same.
  EXPECT_LT(rotation_distance_deg(report->calibration.cameras[0].camera_from_station,
                                  truth.camera_from_station[0]),
            0.01);
}

TEST(TableCalibration, WrongCornersAreOutvoted) {
  const SyntheticTable truth;
  auto views = truth.views();
  for (std::size_t i = 0; i < views.size(); i += 3) {
    views[i].corners[5].position_px.x() += 7.0;
    views[i].corners[40].position_px.y() -= 20.0;
  }
  const auto report = calibrate_table(views, truth.cameras, truth.board);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_LT(axis_error_mm(truth, report->calibration), 0.01);
  EXPECT_LT(report->rms_px, 0.04);
}

TEST(TableCalibration, ViewWithoutTheBoardIsNamed) {
  const SyntheticTable truth;
  auto views = truth.views();
  views[7].corners.clear();
  EXPECT_THAT(failure(calibrate_table(views, truth.cameras, truth.board)),
              AllOf(HasSubstr("cam1 at stop 3"), HasSubstr("not visible")));
  views = truth.views();
  views[7].corners.resize(5);
  EXPECT_THAT(failure(calibrate_table(views, truth.cameras, truth.board)),
              AllOf(HasSubstr("cam1 at stop 3"), HasSubstr("only 5 corners")));
  // A single row of corners fixes no pose.
  views = truth.views();
  views[7].corners.resize(9);
  EXPECT_THAT(failure(calibrate_table(views, truth.cameras, truth.board)),
              AllOf(HasSubstr("cam1 at stop 3"), HasSubstr("don't tell where the board is")));
}

TEST(TableCalibration, TooFewOrTooNarrowStopsAreRefused) {
  SyntheticTable truth;
  truth.commanded_deg = {0.0, 90.0, 180.0, 270.0};
  EXPECT_THAT(failure(truth.calibrate()), HasSubstr("only 4 stops"));
  truth.commanded_deg = {0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0};
  EXPECT_THAT(failure(truth.calibrate()), HasSubstr("span 60 deg only"));
  truth.commanded_deg = {0.0, 130.0, 260.0, 30.0, 160.0, 290.0};
  EXPECT_THAT(failure(truth.calibrate()), HasSubstr("direction of turning can't be told"));
}

TEST(TableCalibration, TableThatDoesNotTurnIsNoticed) {
  SyntheticTable truth;
  truth.true_angle = [](int, double) { return 0.0; };
  EXPECT_THAT(failure(truth.calibrate()), HasSubstr("does not turn"));
}

TEST(TableCalibration, WrongLensIsRefused) {
  SyntheticTable truth;
  const auto views = truth.views();
  for (TableCamera& camera : truth.cameras) {
    camera.lens.cx += 300.0;
    camera.lens.fx *= 1.3;
  }
  EXPECT_THAT(failure(calibrate_table(views, truth.cameras, truth.board)),
              HasSubstr("off where a turning board would have them"));
}

TEST(TableCalibration, SenselessInputIsRefused) {
  const SyntheticTable truth;
  const auto refused = [&](auto change) {
    auto views = truth.views();
    auto cameras = truth.cameras;
    CharucoBoard board = truth.board;
    change(views, cameras, board);
    const auto result = calibrate_table(views, cameras, board);
    EXPECT_TRUE(result || result.error().kind == ErrorKind::bad_input);
    return failure(result);
  };
  EXPECT_THAT(refused([](auto& v, auto&, auto&) { v[0].camera = "cam9"; }), HasSubstr("cam9"));
  EXPECT_THAT(refused([](auto& v, auto&, auto&) { v[1].commanded_deg = 1.0; }),
              HasSubstr("not that of the stop's other views"));
  EXPECT_THAT(refused([](auto& v, auto&, auto&) { v[1].camera = "cam0"; }),
              HasSubstr("second view of the same stop"));
  EXPECT_THAT(refused([](auto& v, auto&, auto&) { v[1].corners[0].id = 999; }),
              HasSubstr("corner 999"));
  EXPECT_THAT(refused([](auto& v, auto&, auto&) { v[1].corners[0].id = 1; }),
              HasSubstr("there twice"));
  EXPECT_THAT(refused([](auto&, auto& c, auto&) { c[0].lens = Lens{}; }),
              HasSubstr("no intrinsics"));
  EXPECT_THAT(refused([](auto&, auto& c, auto&) { c[1].id = "cam0"; }), HasSubstr("twice"));
  EXPECT_THAT(refused([](auto&, auto& c, auto&) {
                c.push_back({"cam2", c[0].lens});
              }),
              HasSubstr("has no views"));
  EXPECT_THAT(refused([](auto&, auto&, auto& b) { b.square_mm = 0.0; }), HasSubstr("squares"));
  TableCalibrationOptions options;
  options.max_step_deg = 200.0;
  EXPECT_THAT(failure(calibrate_table(truth.views(), truth.cameras, truth.board, options)),
              HasSubstr("options"));
}

TEST(TurnRegression, ContinuesThroughFullTurnsEitherWay) {
  std::vector<double> commanded, forward, backward;
  for (int i = 0; i < 30; ++i) {
    commanded.push_back(wrapped_deg(30.0 * i));
    forward.push_back(turn_deg(0.0, 0.95 * 30.0 * i + 12.0));
    backward.push_back(turn_deg(0.0, -1.02 * 30.0 * i + 12.0));
  }
  const TurnRegression there = regress_turns(commanded, forward);
  EXPECT_NEAR(there.slope, 0.95, 1e-12);
  EXPECT_NEAR(there.offset_deg, 12.0, 1e-9);
  EXPECT_NEAR(there.commanded_deg.back(), 870.0, 1e-9);
  EXPECT_NEAR(there.measured_deg.back(), 0.95 * 870.0, 1e-9);
  EXPECT_NEAR(there.rms_deg, 0.0, 1e-9);
  EXPECT_NEAR(regress_turns(commanded, backward).slope, -1.02, 1e-12);
}

TEST(TurnRegression, OutlyingStopsHaveLittleWeight) {
  Random random(5);
  std::vector<double> commanded, measured;
  for (int i = 0; i < 24; ++i) {
    commanded.push_back(15.0 * i);
    measured.push_back(15.0 * i + random.normal(0.0, 0.01) + (i % 8 == 7 ? 5.0 : 0.0));
  }
  const TurnRegression turns = regress_turns(commanded, measured);
  EXPECT_NEAR(turns.slope, 1.0, 2e-4);
  EXPECT_GT(turns.rms_deg, 1.0);
}

}  // namespace
}  // namespace skullstation
