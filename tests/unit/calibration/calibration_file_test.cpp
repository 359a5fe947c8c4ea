#include "capture/calibration/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "capture/calibration/utc_text.h"
#include "core/clock.h"
#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

CameraCalibration some_camera() {
  CameraCalibration calibration;
  calibration.camera = "cam0";
  calibration.device = "HD Pro Webcam C920 A1B2";
  calibration.created = "2026-01-31T12:00:00.000Z";
  calibration.lens =
      Lens::from_params(1600, 1200, LensModel::opencv,
                        {2800.25, 2799.5, 807.3, 596.1, -0.1234567890123, 0.05, 1e-4, -2e-4});
  calibration.standard_errors = {0.5, 0.51, 0.4, 0.41, 1e-3, 2e-3, 1e-5, 2e-5};
  calibration.rms_px = 0.04;
  calibration.views = 19;
  calibration.corners = 3000;
  return calibration;
}

TableCalibration some_table() {
  TableCalibration calibration;
  calibration.created = "2026-01-31T12:00:00.000Z";
  calibration.board.squares_x = 10;
  calibration.table_from_board = rotation_about_z(0.4);
  calibration.table_from_board.translation = {1.5, -2.25, 0.0};
  calibration.wobble_mm = 0.05;
  calibration.axis_error_deg = 0.001;
  calibration.axis_error_mm = 0.002;
  calibration.turn_ratio = 0.99999;
  calibration.turn_ratio_error = 1e-5;
  calibration.angle_rms_deg = 0.004;
  CameraPlacement placement;
  placement.camera = "cam0";
  placement.camera_from_station = rotation_about_z(33.0);
  placement.camera_from_station.translation = {0.1, 0.2, 700.0};
  placement.rms_px = 0.05;
  calibration.cameras = {placement, placement};
  calibration.cameras[1].camera = "cam1";
  return calibration;
}

/// The error of reading the file after a change to its JSON.
std::string camera_fault(const std::function<void(json&)>& change) {
  const TemporaryFolder folder;
  EXPECT_TRUE(write_camera_calibration(some_camera(), folder / "camera-cam0.json"));
  json document = json::parse(read_file(folder / "camera-cam0.json").value());
  change(document);
  EXPECT_TRUE(write_file_durably(folder / "camera-cam0.json", document.dump()));
  const auto read = read_camera_calibration(folder / "camera-cam0.json");
  EXPECT_FALSE(read);
  if (read) return {};
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(read.error().where, HasSubstr("camera-cam0.json"));
  return read.error().message();
}

std::string table_fault(const std::function<void(json&)>& change) {
  const TemporaryFolder folder;
  EXPECT_TRUE(write_table_calibration(some_table(), folder / "table.json"));
  json document = json::parse(read_file(folder / "table.json").value());
  change(document);
  EXPECT_TRUE(write_file_durably(folder / "table.json", document.dump()));
  const auto read = read_table_calibration(folder / "table.json");
  EXPECT_FALSE(read);
  return read ? std::string() : read.error().message();
}

UtcTime at(const char* text) { return from_iso8601(text).value(); }

TEST(CalibrationFile, CameraComesBackToTheLastBit) {
  const TemporaryFolder folder;
  const CameraCalibration written = some_camera();
  ASSERT_TRUE(write_camera_calibration(written, folder / "c.json"));
  const auto read = read_camera_calibration(folder / "c.json");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->camera, written.camera);
  EXPECT_EQ(read->device, written.device);
  EXPECT_EQ(read->created, written.created);
  EXPECT_EQ(read->lens.width, 1600);
  EXPECT_EQ(read->lens.height, 1200);
  EXPECT_EQ(read->lens.params(LensModel::opencv), written.lens.params(LensModel::opencv));
  EXPECT_EQ(read->standard_errors, written.standard_errors);
  EXPECT_EQ(read->rms_px, written.rms_px);
  EXPECT_EQ(read->views, 19);
  EXPECT_EQ(read->corners, 3000);
}

TEST(CalibrationFile, TableComesBack) {
  const TemporaryFolder folder;
  const TableCalibration written = some_table();
  ASSERT_TRUE(write_table_calibration(written, folder / "t.json"));
  const auto read = read_table_calibration(folder / "t.json");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->created, written.created);
  EXPECT_EQ(read->board, written.board);
  EXPECT_LT(rotation_distance_deg(read->table_from_board, written.table_from_board), 1e-10);
  EXPECT_EQ(read->table_from_board.translation, written.table_from_board.translation);
  EXPECT_EQ(read->wobble_mm, written.wobble_mm);
  EXPECT_EQ(read->axis_error_deg, written.axis_error_deg);
  EXPECT_EQ(read->axis_error_mm, written.axis_error_mm);
  EXPECT_EQ(read->turn_ratio, written.turn_ratio);
  EXPECT_EQ(read->turn_ratio_error, written.turn_ratio_error);
  EXPECT_EQ(read->angle_rms_deg, written.angle_rms_deg);
  EXPECT_FALSE(read->reversed);
  ASSERT_EQ(read->cameras.size(), 2U);
  EXPECT_EQ(read->cameras[1].camera, "cam1");
  EXPECT_LT(rotation_distance_deg(read->cameras[1].camera_from_station,
                                  written.cameras[1].camera_from_station),
            1e-10);
  EXPECT_EQ(read->cameras[0].rms_px, 0.05);
}

TEST(CalibrationFile, CameraFaultsNameFileAndPlace) {
  EXPECT_THAT(camera_fault([](json& j) { j["format"] = "skullstation-camera-calibration/9"; }),
              AllOf(HasSubstr("format"), HasSubstr("/9"), HasSubstr("was expected")));
  EXPECT_THAT(camera_fault([](json& j) { j["format"] = "skullstation-table-calibration/1"; }),
              HasSubstr("skullstation-camera-calibration/1"));
  EXPECT_THAT(camera_fault([](json& j) { j.erase("params"); }), HasSubstr("params: is missing"));
  EXPECT_THAT(camera_fault([](json& j) { j["params"].erase(3); }), HasSubstr("8 numbers, not 7"));
  EXPECT_THAT(camera_fault([](json& j) { j["params"][0] = -1.0; }), HasSubstr("focal lengths"));
  EXPECT_THAT(camera_fault([](json& j) { j["params"][2] = "x"; }), HasSubstr("params[2]"));
  EXPECT_THAT(camera_fault([](json& j) { j["model"] = "FISHEYE"; }), HasSubstr("FISHEYE"));
  EXPECT_THAT(camera_fault([](json& j) { j["width"] = 0; }), HasSubstr("width"));
  EXPECT_THAT(camera_fault([](json& j) { j["rms_px"] = -0.1; }), HasSubstr("rms_px"));
  EXPECT_THAT(camera_fault([](json& j) { j["created"] = "yesterday"; }), HasSubstr("created"));
  EXPECT_THAT(camera_fault([](json& j) { j["rms_pz"] = 1; }),
              AllOf(HasSubstr("rms_pz: is an unknown key"), HasSubstr("rms_px")));
  EXPECT_THAT(camera_fault([](json& j) { j = json::array(); }), HasSubstr("must be an object"));
}

TEST(CalibrationFile, TableFaultsNameFileAndPlace) {
  EXPECT_THAT(table_fault([](json& j) { j["format"] = 3; }), HasSubstr("format"));
  EXPECT_THAT(table_fault([](json& j) { j["table_from_board"][1][1] = 2.0; }),
              HasSubstr("table_from_board: must hold a rotation"));
  EXPECT_THAT(table_fault([](json& j) { j["table_from_board"][3][0] = 1.0; }),
              HasSubstr("4x4 matrix"));
  EXPECT_THAT(table_fault([](json& j) { j["table_from_board"][0].erase(0); }),
              HasSubstr("4x4 matrix"));
  EXPECT_THAT(table_fault([](json& j) { j["table_from_board"] = 1; }), HasSubstr("4x4 matrix"));
  EXPECT_THAT(table_fault([](json& j) { j["cameras"][1].erase("camera_from_station"); }),
              HasSubstr("cameras[1].camera_from_station: is missing"));
  EXPECT_THAT(table_fault([](json& j) { j["board"]["marker_mm"] = 99.0; }),
              AllOf(HasSubstr("board"), HasSubstr("smaller than")));
  EXPECT_THAT(table_fault([](json& j) { j.erase("board"); }), HasSubstr("board: is missing"));
  EXPECT_THAT(table_fault([](json& j) { j.erase("reversed"); }), HasSubstr("reversed: is missing"));
  EXPECT_THAT(table_fault([](json& j) { j["created"] = "2026-02-31T00:00:00Z"; }),
              HasSubstr("created"));
}

TEST(CalibrationFile, DamagedOrMissingFilesAreNamed) {
  const TemporaryFolder folder;
  const auto missing = read_table_calibration(folder / "table.json");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message(), HasSubstr("table.json"));
  ASSERT_TRUE(write_file_durably(folder / "table.json", "{ \"format\": "));
  const auto damaged = read_table_calibration(folder / "table.json");
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message(), AllOf(HasSubstr("table.json"), HasSubstr("line 1")));
  EXPECT_FALSE(write_table_calibration(some_table(), folder / "nowhere" / "table.json"));
  EXPECT_FALSE(write_camera_calibration(some_camera(), folder / "nowhere" / "camera.json"));
}

TEST(CalibrationWarnings, NoneForAFreshCalibrationOfTheSameCamera) {
  EXPECT_THAT(calibration_warnings(some_camera(), "HD Pro Webcam C920 A1B2",
                                   at("2026-03-01T00:00:00Z"), std::chrono::days(90)),
              IsEmpty());
  EXPECT_THAT(calibration_warnings(some_table(), at("2026-03-01T00:00:00Z"), std::chrono::days(90)),
              IsEmpty());
}

TEST(CalibrationWarnings, ChangedCameraStaleFileAndWrongClock) {
  EXPECT_THAT(calibration_warnings(some_camera(), "Brio 7", at("2026-06-30T12:00:00Z"),
                                   std::chrono::days(90)),
              ElementsAre(AllOf(HasSubstr("cam0"), HasSubstr("A1B2"), HasSubstr("Brio 7")),
                          AllOf(HasSubstr("150 days old"), HasSubstr("valid are 90 days"))));
  EXPECT_THAT(calibration_warnings(some_table(), at("2026-06-30T12:00:00Z"), std::chrono::days(90)),
              ElementsAre(HasSubstr("150 days old")));
  EXPECT_THAT(calibration_warnings(some_table(), at("2025-06-30T12:00:00Z"), std::chrono::days(90)),
              ElementsAre(HasSubstr("clocks was wrong")));
  CameraCalibration undated = some_camera();
  undated.created = "?";
  EXPECT_THAT(calibration_warnings(undated, undated.device, at("2026-03-01T00:00:00Z"),
                                   std::chrono::days(90)),
              ElementsAre(HasSubstr("no readable date")));
}

TEST(MotionVerdicts, TellTheFaultsApart) {
  TableCalibration table = some_table();
  EXPECT_THAT(motion_verdicts(table), IsEmpty());
  table.turn_ratio = 1.02;
  EXPECT_THAT(motion_verdicts(table),
              ElementsAre(AllOf(HasSubstr("2.0 % more"), HasSubstr("by 0.98039"))));
  table.turn_ratio = 0.995;
  table.angle_rms_deg = 0.8;
  EXPECT_THAT(motion_verdicts(table),
              ElementsAre(AllOf(HasSubstr("0.50 % less"), HasSubstr("irregularly")),
                          HasSubstr("0.80 deg")));
  // Within its own error a ratio says nothing.
  table.turn_ratio_error = 0.002;
  EXPECT_THAT(motion_verdicts(table), ElementsAre(HasSubstr("0.80 deg")));
  table = some_table();
  table.reversed = true;
  table.wobble_mm = 1.25;
  EXPECT_THAT(motion_verdicts(table), ElementsAre(HasSubstr("against the commanded direction"),
                                                  HasSubstr("wobbles by 1.25 mm")));
}

TEST(UtcText, ReadsWhatTheClockWrites) {
  const UtcTime time = at("2026-01-31T12:34:56.789Z");
  EXPECT_EQ(to_iso8601(time), "2026-01-31T12:34:56.789Z");
  EXPECT_EQ(at("2026-01-31T12:34:56Z") + std::chrono::milliseconds(789), time);
  EXPECT_EQ(at("1970-01-01T00:00:00Z"), UtcTime{});
}

TEST(UtcText, NothingElse) {
  for (const char* text : {"", "Z", "2026-01-31", "2026-01-31T12:34:56", "2026-13-01T00:00:00Z",
                           "2026-02-29T00:00:00Z", "2026-01-31T24:00:00Z", "2026-01-31T12:60:00Z",
                           "2026-01-31 12:34:56Z", "2026-01-31T12:34:56+01:00Z",
                           "2026-01-31T12:34:56.7a9Z", "2026-01-31T1x:34:56Z"}) {
    EXPECT_FALSE(from_iso8601(text)) << text;
  }
}

}  // namespace
}  // namespace skullstation
