#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/progress.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "reconstruction/photogrammetry/poses.h"

namespace skullstation {

struct MotionPoseOptions {
  /// Distance of the first camera's centre from the table's axis [mm]: gives the scale where table
  /// angles are known and neither a board nor given poses do.
  std::optional<double> camera_radius_mm;
  int least_points = 25;  ///< that a view must share with others
  /// A view whose points lie farther off than both of these contradicts the others: this ...
  double always_good_rms_px = 1.5;
  /// ... and so many times the median of all views.
  double times_median = 3.0;
  /// With table angles: a view farther off its camera's circle than both of these is wrong: this
  /// part of the camera's distance (1.5 mm at 750 mm) ...
  double always_good_departure = 0.002;
  /// ... and so many times the median of all views.
  double times_median_departure = 5.0;
  std::string colmap = "colmap";
  std::uint64_t seed = 1;
  int threads = 0;
};

/// The pairs of views worth matching: neighbours by the table's angle where it is known (32 deg on
/// one camera's ring, 16 deg between rings, two neighbours at least), all pairs where they are
/// few or small (25 views of 2 megapixels, 60 of 0.3), else those near in time, the last beside the
/// first, and some by powers of two apart. \pre all views are of one pass
std::vector<std::pair<int, int>> pairs_to_match(std::span<const PoseObservation> views,
                                                std::span<const PoseCamera> cameras);

/// Poses without a board's help: structure from motion over the specimen's own features, pass by
/// pass. Lenses with `lens` are kept as they are, others estimated. Frame and scale come from the
/// board where the views show it, else from the poses that came with the session, else the scale
/// from table angles and `camera_radius_mm`, else it is unknown and so marked: then the cameras are
/// 1000 units from where they look. Views that are not connected to the others, or contradict
/// them, are dropped and named. Standard errors of the views are not known.
///
/// Errors: bad_input without COLMAP; no_result where too few views are connected, or two passes
/// have no scale in common; cancelled.
Result<PoseResult> poses_from_motion(const std::vector<PoseObservation>& views,
                                     const std::vector<Image8>& photographs,
                                     const std::vector<PoseCamera>& cameras,
                                     const std::optional<CharucoBoard>& board,
                                     const MotionPoseOptions& options = {},
                                     const Progress& progress = {});

}  // namespace skullstation
