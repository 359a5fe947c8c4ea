#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/result.h"

namespace skullstation {

/// A printed ChArUco board: the station's ruler. Board frame: origin at the board's centre, x to
/// the right and y up on the printed page, z out of the paper, in mm. On a turntable the board
/// lies face up and centred near the axis.
///
/// The pattern is our own definition, whatever OpenCV's version does: the square at the page's top
/// left is black, white squares hold the dictionary's markers 0, 1, 2 ... row by row, upright.
/// This is what OpenCV prints since 4.6 (before, only for an odd number of rows).
struct CharucoBoard {
  std::string dictionary = "DICT_5X5_1000";
  int squares_x = 14;
  int squares_y = 14;
  double square_mm = 25.0;
  double marker_mm = 19.0;

  /// Errors (bad_input) say what a board can't be.
  Result<void> validate() const;
  double width_mm() const { return squares_x * square_mm; }
  double height_mm() const { return squares_y * square_mm; }
  int corner_count() const { return (squares_x - 1) * (squares_y - 1); }

  /// Position of an inner chessboard corner in the board frame (z = 0). Corners are numbered row
  /// by row from the page's top left.
  Eigen::Vector3d corner(int id) const;

  bool operator==(const CharucoBoard&) const = default;
};

/// The board as it is printed, top of the page up: `pixels_per_square` px a square, 1 channel,
/// no margin. Sampled by area, so squares and markers keep their exact size.
/// \pre board.validate()
Image8 draw_board(const CharucoBoard& board, int pixels_per_square);

struct BoardCorner {
  int id = 0;
  Eigen::Vector2d position_px;  ///< pixel (0.5, 0.5) is the centre of the top-left pixel
};

/// The inner corners seen in the image (1 channel, or 3: RGB), refined to sub-pixel accuracy, in
/// the order of their ids; empty if there are none, or for an image or board that is no such thing.
/// Hidden corners are left out. Needs two neighbouring markers of about 10 px a side or more; a
/// mirrored board is none. Deterministic.
std::vector<BoardCorner> detect_board(const Image8& image, const CharucoBoard& board);

}  // namespace skullstation
