#pragma once

#include <optional>
#include <vector>

#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

struct BoardView {
  Rigid3 camera_from_board;
  double rms_px = 0.0;
};

/// Where the board is, from its corners in one image: the homography's pose (Zhang 2000) and its
/// mirror image about the line of sight, which explains a small or far board nearly as well, each
/// refined to the least reprojection error (Gauss-Newton, Huber weights of 1 px); the better one
/// counts. Nothing for fewer than 6 corners, corners on a line or corners that no pose explains.
std::optional<BoardView> find_board(const std::vector<BoardCorner>& corners,
                                    const CharucoBoard& board, const Lens& lens);

/// Distances of the corners from where the board at this pose has them [px].
std::vector<double> corner_errors_px(const std::vector<BoardCorner>& corners,
                                     const CharucoBoard& board, const Lens& lens,
                                     const Rigid3& camera_from_board);

/// Root mean square of errors; 0 for none.
double root_mean_square(const std::vector<double>& errors);

}  // namespace skullstation
