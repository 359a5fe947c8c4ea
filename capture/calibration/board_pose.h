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

/// Where the board is, from its corners in one image: the better of the two solutions that a plane
/// allows (Collins & Bartoli 2014, IPPE). In closed form, fast and good to a start. Nothing for
/// fewer than 6 corners, corners on a line, or corners that no pose explains.
std::optional<BoardPose> rough_board_pose(const std::vector<BoardCorner>& corners,
                                          const CharucoBoard& board, const Lens& lens);

/// The same, each solution refined to the least reprojection error (Huber loss of 1 px) first.
std::optional<BoardPose> estimate_board_pose(const std::vector<BoardCorner>& corners,
                                             const CharucoBoard& board, const Lens& lens);

/// Root mean square reprojection error [px].
double reprojection_rms_px(const std::vector<BoardCorner>& corners, const CharucoBoard& board,
                           const Lens& lens, const Rigid3& camera_from_board);

}  // namespace skullstation
