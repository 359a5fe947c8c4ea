#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// Intrinsics of one camera, with what is needed to trust them and to notice that they are stale.
struct CameraCalibration {
  std::string camera;   ///< id in station.toml
  std::string device;   ///< CameraDescription::model and serial: a changed camera is noticed
  std::string created;  ///< UTC, ISO 8601
  Lens lens;
  std::vector<double> standard_errors;  ///< px and 1, in the order of OPENCV's parameters
  double rms_px = 0.0;
  int views = 0;
  int corners = 0;
};

/// Pose of one camera relative to the table at angle 0.
struct CameraPlacement {
  std::string camera;
  Rigid3 camera_from_station;  ///< `station`: the table frame at angle 0; it does not turn
  double rms_px = 0.0;
};

struct TableCalibration {
  std::string created;
  CharucoBoard board;
  Rigid3 table_from_board;        ///< the board's pose on the platter
  double wobble_mm = 0.0;         ///< greatest departure from a pure rotation, at the board's rim
  double axis_error_deg = 0.0;    ///< standard error of the axis direction
  double axis_error_mm = 0.0;     ///< standard error of the axis position
  double turn_ratio = 1.0;        ///< measured turn / commanded turn; 1 if steps_per_turn is right
  double turn_ratio_error = 0.0;  ///< its standard error
  double angle_rms_deg = 0.0;     ///< measured against commanded angle, ratio taken out
  bool reversed = false;          ///< the table turns against the commanded direction
  std::vector<CameraPlacement> cameras;
};

/// The station's calibration files: FOLDER/camera-<id>.json and FOLDER/table.json, formats
/// "skullstation-camera-calibration/1" and "skullstation-table-calibration/1". Read strictly:
/// errors (bad_input) name the file and the place in it. Written whole or not at all.
Result<CameraCalibration> read_camera_calibration(const std::filesystem::path& file);
Result<void> write_camera_calibration(const CameraCalibration&, const std::filesystem::path& file);
Result<TableCalibration> read_table_calibration(const std::filesystem::path& file);
Result<void> write_table_calibration(const TableCalibration&, const std::filesystem::path& file);

/// What `doctor` has to say about a calibration, one sentence each; none if it is to be trusted.
/// `device` is the camera in use now, written as the calibration's own `device` is.
std::vector<std::string> calibration_warnings(const CameraCalibration& calibration,
                                              const std::string& device, UtcTime now,
                                              std::chrono::days max_age);

/// The same for the table: age, and a platter that turns wrongly, slips or wobbles.
std::vector<std::string> calibration_warnings(const TableCalibration& calibration, UtcTime now,
                                              std::chrono::days max_age);

/// What is wrong with the table's motion, one sentence each with what to do about it: turns the
/// wrong way, too far or too short, irregularly, or wobbles.
std::vector<std::string> motion_verdicts(const TableCalibration& calibration);

}  // namespace skullstation
