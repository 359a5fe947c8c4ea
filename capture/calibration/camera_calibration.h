#pragma once

#include <string>
#include <vector>

#include "capture/calibration/calibration_file.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/transform.h"

namespace skullstation {

/// One picture of the hand-held board.
struct CalibrationView {
  std::string name;  ///< for messages: the file or "view 7"
  std::vector<BoardCorner> corners;
};

struct CameraCalibrationOptions {
  /// Views with enough corners, blurred and bad ones left out.
  int min_views = 8;
  /// Corners a view needs to count; eight unknowns of its homography, with some to spare.
  int min_corners_per_view = 12;
  /// A view looks at the board aslant from this angle between the board's normal and the camera's
  /// axis on; frontal views can't tell a longer lens from a farther board (Zhang 2000).
  double tilted_from_deg = 15.0;
  /// So many views must be aslant ...
  int min_tilted_views = 4;
  /// ... in directions that differ by at least this.
  double min_tilt_spread_deg = 60.0;
  /// Share of the image's 8 x 6 cells in which corners were seen: where none were, the lens's
  /// distortion is a guess.
  double min_coverage = 0.5;
  /// Standard error of the focal lengths, in percent of them.
  double max_focal_error_percent = 0.1;
  /// Reprojection error of the views kept; more is a bent or wrongly described board.
  double max_rms_px = 0.7;

  Result<void> validate() const;
};

/// What became of one view.
struct CalibrationViewReport {
  std::string name;
  int corners = 0;
  double rms_px = 0.0;
  double tilt_deg = 0.0;  ///< between the board's normal and the camera's axis
  std::string left_out;   ///< why; empty if the view was used
  Rigid3 camera_from_board;
};

struct CameraCalibrationReport {
  /// `camera`, `device` and `created` are the caller's to fill in.
  CameraCalibration calibration;
  std::vector<CalibrationViewReport> views;  ///< in the order given
  double coverage = 0.0;                     ///< share of the image's cells with corners
};

/// Intrinsics (OPENCV model) from views of a flat board of known squares, after Zhang (2000):
/// poses and intrinsics in one bundle adjustment; views and corners that contradict the others are
/// left out and named; standard errors from the adjustment's covariance, scaled with the residuals
/// found. Errors: bad_input for options or views that are none; no_result with the reason and the
/// remedy where the views can't give intrinsics worth having. A wrong `square_mm` is not noticed
/// and does no harm here: intrinsics don't depend on the board's size.
Result<CameraCalibrationReport> calibrate_camera(const std::vector<CalibrationView>& views,
                                                 const CharucoBoard& board, int width, int height,
                                                 const CameraCalibrationOptions& options = {});

/// Distance at which the frontal board fills four fifths of the image.
double filling_distance_mm(const CharucoBoard& board, const Lens& lens);

/// camera_from_board of 20 views that make a good calibration: the board aslant in all directions,
/// all over the image, within 10 % of `distance_mm`, where the camera is focused. The board may
/// reach beyond the frame. For instructions to the operator and for the simulated station; `lens`
/// may be a guess.
std::vector<Rigid3> calibration_poses(const Lens& lens, double distance_mm);

}  // namespace skullstation
