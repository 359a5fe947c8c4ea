#pragma once

#include <optional>
#include <vector>

#include "core/image.h"
#include "core/session/charuco_board.h"

namespace skullstation {

/// Where the specimen and the board are in a view, at a quarter of its resolution. Made for the
/// capture gates: quick, and rather too small than wrong.
struct ViewRegions {
  static constexpr int scale = 4;
  Image8 specimen;  ///< 255 where the specimen is; ceil(width / 4) x ceil(height / 4)
  Image8 board;     ///< 255 where the board is or would be without the specimen on it
};

/// Finds the specimen in front of a plain, dark backdrop, on a table with or without a board.
///
/// Off the table it is what is brighter than the backdrop (hysteresis, Canny 1986). On the board,
/// whose white paper is as bright as bone, it is where squares that ought to be black are not:
/// they are looked up in the print by the homography through the detected corners. The table
/// around the board, out to a tenth beyond the board's corners, is left out. Without a board, or
/// with none of its corners in sight, the table must be as dark as the backdrop.
///
/// Fewer than 8 corners say only roughly where the board is. Then nothing on it or near it counts
/// as specimen, and if they lie on a line nothing at all: white squares must never pass for bone.
///
/// `grey` has 1 channel.
ViewRegions find_specimen(const Image8& grey, const std::vector<BoardCorner>& corners,
                          const std::optional<CharucoBoard>& board);

}  // namespace skullstation
