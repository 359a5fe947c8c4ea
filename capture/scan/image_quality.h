#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/session.h"

namespace skullstation {

/// What a view must reach to be accepted. The defaults were measured on simulated scans of a
/// skull (docs/sessions.md, "Gates").
struct QualityGates {
  /// Sharpness (see measure_view) below this is out of focus or blurred, whatever the specimen.
  double min_sharpness = 0.02;
  /// … and so is less than this part of the median of the same camera's accepted views.
  double min_sharpness_of_median = 0.2;
  int views_for_median = 5;  ///< the comparison begins with so many accepted views
  double max_clipped_percent = 1.0;
  double max_dark_percent = 40.0;
  double min_mean_level = 40.0;  ///< grey levels
  double max_mean_level = 225.0;
  double max_motion_px = 0.3;
  double max_border_percent = 0.5;
  double min_specimen_percent = 1.0;  ///< less is an empty table
  int min_board_corners = 12;         ///< where there is a board

  Result<void> validate() const;
};

/// Measures one view.
///
/// `image` is grey or RGB; `earlier` a second frame of the same scene at rest, taken shortly
/// before, of the same size. Noise is told from detail by being independent between the two. Null
/// if there is none: noise then counts as detail, and motion_px stays 0.
///
/// - sharpness: energy of the specimen's finest detail (Laplacian at full resolution) over that
///   of detail four times as coarse, noise removed from both. The ratio does not depend on the
///   specimen's contrast and little on the side that faces the camera; it falls steeply with blur.
/// - motion_px: least-squares shift (Lucas & Kanade 1981) of blocks of the specimen and the board
///   between the two frames; the upper quartile of the blocks, so that a turn about an axis inside
///   the image shows as well as a shift.
/// - board_corners, the specimen's share of the frame and of its border, its levels.
ViewQuality measure_view(const Image8& image, const Image8* earlier,
                         const std::optional<CharucoBoard>& board);

/// Why the view is not good enough, or nothing. `accepted_sharpness` are the sharpness values of
/// the same camera's accepted views so far.
std::optional<std::string> failed_gate(const ViewQuality& quality, const QualityGates& gates,
                                       std::span<const double> accepted_sharpness,
                                       bool board_expected);

}  // namespace skullstation
