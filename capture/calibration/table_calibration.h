#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/calibration/calibration_file.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"

namespace skullstation {

struct TableCamera {
  std::string id;
  Lens lens;  ///< calibrated
};

/// What one camera saw while the table stood still.
struct TableView {
  std::string name;  ///< for messages: "cam0 at 30 deg"
  std::string camera;
  int stop = 0;                ///< the same for all cameras' views between two moves; in the order
                               ///< of time
  double commanded_deg = 0.0;  ///< what the table was told
  std::vector<BoardCorner> corners;
};

struct TableCalibrationOptions {
  int min_stops = 6;
  /// The commanded angles must span so much of the circle.
  double min_span_deg = 180.0;
  /// Between one stop and the next; beyond, the direction of turning could not be told.
  double max_step_deg = 120.0;
  int min_corners_per_view = 8;
  /// Reprojection error; more means intrinsics or a board description that don't fit.
  double max_rms_px = 2.0;

  Result<void> validate() const;
};

struct TableStopReport {
  int stop = 0;
  double commanded_deg = 0.0;
  double measured_deg = 0.0;  ///< continues through full turns; 0 where commanded is 0
  double residual_deg = 0.0;  ///< measured, less turn_ratio times commanded (with its sign)
  double wobble_mm = 0.0;     ///< at the board's rim, against a pure rotation
};

struct TableCalibrationReport {
  TableCalibration calibration;  ///< `created` is the caller's to fill in
  std::vector<TableStopReport> stops;
  std::vector<std::string> verdicts;  ///< motion_verdicts(); empty if the table moves as told
  double rms_px = 0.0;
};

/// Axis, angles and camera placements from views of the board lying on the turning platter, in one
/// bundle adjustment over the board's pose on the platter, one angle per stop (free: the commanded
/// one is not believed) and one pose per camera. The commanded angles are compared afterwards, by
/// robust regression, so that a table which slips, or whose steps_per_turn is wrong, is found out.
///
/// The table frame: origin on the axis in the board's plane, z up along the axis, x along the
/// board's x at angle 0; angles count counter-clockwise seen from above.
///
/// Errors: bad_input for what no calibration can use (the view with too few corners is named; too
/// few stops, too small a span, a camera without a lens); no_result where the corners don't fit a
/// turning board.
Result<TableCalibrationReport> calibrate_table(const std::vector<TableView>& views,
                                               const std::vector<TableCamera>& cameras,
                                               const CharucoBoard& board,
                                               const TableCalibrationOptions& options = {});

}  // namespace skullstation
