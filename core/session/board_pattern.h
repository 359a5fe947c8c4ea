#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/session/charuco_board.h"

namespace skullstation {

/// The bits of a predefined ArUco dictionary's markers.
struct MarkerDictionary {
  std::string name;
  int size = 0;  ///< how many markers it has
  int bits = 0;  ///< along a marker's side, without the black border of one bit
};

/// By its OpenCV name ("DICT_5X5_1000"); nothing if there is none such.
std::optional<MarkerDictionary> marker_dictionary(const std::string& name);

/// 1 channel, bits x bits: 255 where the marker is white. \pre 0 <= id < dictionary.size
Image8 marker_bits(const MarkerDictionary& dictionary, int id);

/// A marker of the board by its square, counted from the page's top left.
struct BoardMarker {
  int id = 0;
  int column = 0;
  int row = 0;
};

/// All markers in the order of their ids: white squares row by row, from the page's top left,
/// whose own square is black.
std::vector<BoardMarker> board_markers(const CharucoBoard& board);

/// Corners of a marker in the board frame [mm], x and y: top left, top right, bottom right,
/// bottom left on the page (4 x 2).
Eigen::Matrix<double, 4, 2> marker_corners(const CharucoBoard& board, const BoardMarker& marker);

}  // namespace skullstation
