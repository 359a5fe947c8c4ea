#pragma once

#include <optional>
#include <vector>

#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

struct BoardPose {
  Rigid3 camera_from_board;
  double rms_px = 0.0;  ///< root mean square distance of the corners from their projection
};

/// Where the board is, from its corners in one image: the homography's pose (Zhang 2000) and its
/// mirror image about the line of sight, which explains a small or far board nearly as well, each
/// refined to the least reprojection error (Gauss-Newton, Huber weights of 1 px); the better one
/// counts. Nothing for fewer than 6 corners, corners on a line or corners that no pose explains.
std::optional<BoardPose> find_board_pose(const std::vector<BoardCorner>& corners,
                                         const CharucoBoard& board, const Lens& lens);

/// Distances of the corners from where the board at this pose has them [px].
std::vector<double> corner_errors_px(const std::vector<BoardCorner>& corners,
                                     const CharucoBoard& board, const Lens& lens,
                                     const Rigid3& camera_from_board);

}  // namespace skullstation
