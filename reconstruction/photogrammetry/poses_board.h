#pragma once

#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "reconstruction/photogrammetry/poses.h"

namespace skullstation {

struct BoardPoseOptions {
  int least_corners = 8;  ///< a view with fewer can't be trusted
  int least_views = 3;    ///< of a specimen, for a surface
  /// A view whose error exceeds both of these contradicts the others: this ...
  double always_good_rms_px = 0.3;
  /// ... and so many times the median of all views.
  double times_median = 3.5;
  /// Median error of all views; more means a lens or a board that are not what is said of them.
  double worst_median_rms_px = 1.0;
  /// How far a calibrated lens may be off by now: focal length, principal point, k1 k2, p1 p2.
  double focal_sd_percent = 0.5;
  double centre_sd_percent = 0.15;  ///< of the image's width
  double radial_sd = 0.02;
  double tangential_sd = 5e-4;
  /// A focal length that the board shows to be off by more is an error, not an adjustment.
  double most_focal_change_percent = 2.0;
  /// Poses that came with the session must give the same scale, so nearly.
  double most_scale_difference_percent = 1.0;
  int threads = 0;

  Result<void> validate() const;
};

/// The poses of all views that show the board, from its corners: each view by itself first, then
/// all in one bundle adjustment with the lenses as far as the corners tell more about them than
/// the calibration does, and, where the table's angles are known, with each ring's cameras drawn
/// to a circle about the axis, as nearly as the table is found to keep to it. Views that
/// contradict the others are dropped and named.
///
/// The table frame's origin is on the axis in the board's plane, z up, x along the board's x;
/// without angles (or in a pass where nothing turned) it is the board's frame.
///
/// Errors: bad_input for options or cameras that are none; no_result, with the reason and the
/// remedy, where too few views show the board, or the board's picture contradicts the lens or the
/// poses that came with the session.
Result<PoseResult> poses_from_board(const std::vector<PoseObservation>& views,
                                    const std::vector<PoseCamera>& cameras,
                                    const CharucoBoard& board, const BoardPoseOptions& options = {},
                                    const Progress& progress = {});

}  // namespace skullstation
