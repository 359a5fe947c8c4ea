#include "capture/simulation/board_print.h"

#include <algorithm>
#include <cmath>

#include "core/session/board_pattern.h"

namespace skullstation {

namespace {

/// Bits along a marker with its black border.
int marker_cells(const CharucoBoard& board) {
  return marker_dictionary(board.dictionary)->bits + 2;
}

}  // namespace

BoardPrint::BoardPrint(const CharucoBoard& board)
    : board_(board), cells_per_square_(marker_cells(board) + 2) {
  // Cells of a square: margin, the marker's bits, margin.
  const int bits = marker_cells(board);
  const double margin_mm = 0.5 * (board.square_mm - board.marker_mm);
  const int squares = std::max(board.squares_x, board.squares_y);
  for (int square = 0; square < squares; ++square) {
    const double begin_mm = square * board.square_mm;
    lines_mm_.push_back(begin_mm);
    for (int bit = 0; bit <= bits; ++bit) {
      lines_mm_.push_back(begin_mm + margin_mm + board.marker_mm * bit / bits);
    }
  }
  lines_mm_.push_back(squares * board.square_mm);

  const int right = board.squares_x * cells_per_square_;
  const int down = board.squares_y * cells_per_square_;
  std::vector<char> black(static_cast<std::size_t>(right) * down, 0);
  const auto is_black = [&](int x, int y) -> char& {
    return black[static_cast<std::size_t>(y) * right + x];
  };
  for (int y = 0; y < down; ++y) {
    for (int x = 0; x < right; ++x) {
      is_black(x, y) = (x / cells_per_square_ + y / cells_per_square_) % 2 == 0 ? 1 : 0;
    }
  }
  const MarkerDictionary dictionary = *marker_dictionary(board.dictionary);
  for (const BoardMarker& marker : board_markers(board)) {
    const Image8 white = marker_bits(dictionary, marker.id);
    for (int y = 0; y < bits; ++y) {
      for (int x = 0; x < bits; ++x) {
        const bool border = x == 0 || y == 0 || x == bits - 1 || y == bits - 1;
        is_black(marker.column * cells_per_square_ + 1 + x,
                 marker.row * cells_per_square_ + 1 + y) =
            border || white.at(x - 1, y - 1) == 0 ? 1 : 0;
      }
    }
  }

  black_area_.assign(static_cast<std::size_t>(right + 1) * (down + 1), 0.0);
  for (int y = 0; y < down; ++y) {
    double in_row = 0.0;
    for (int x = 0; x < right; ++x) {
      if (is_black(x, y)) {
        in_row += (lines_mm_[x + 1] - lines_mm_[x]) * (lines_mm_[y + 1] - lines_mm_[y]);
      }
      black_area_[static_cast<std::size_t>(y + 1) * (right + 1) + x + 1] =
          black_area_[static_cast<std::size_t>(y) * (right + 1) + x + 1] + in_row;
    }
  }
}

int BoardPrint::cell(double along_mm, int squares) const {
  const int square = std::clamp(static_cast<int>(along_mm / board_.square_mm), 0, squares - 1);
  const double bit_mm = board_.marker_mm / (cells_per_square_ - 2);
  const double margin_mm = 0.5 * (board_.square_mm - board_.marker_mm);
  const double inside_mm = along_mm - square * board_.square_mm - margin_mm;
  const int in_square =
      std::clamp(static_cast<int>(std::floor(inside_mm / bit_mm)) + 1, 0, cells_per_square_ - 1);
  return square * cells_per_square_ + in_square;
}

double BoardPrint::black_area(double right_mm, double down_mm) const {
  const double x = std::clamp(right_mm, 0.0, board_.width_mm());
  const double y = std::clamp(down_mm, 0.0, board_.height_mm());
  const int cx = cell(x, board_.squares_x);
  const int cy = cell(y, board_.squares_y);
  // The integral is bilinear inside a cell.
  const double u = (x - lines_mm_[cx]) / (lines_mm_[cx + 1] - lines_mm_[cx]);
  const double v = (y - lines_mm_[cy]) / (lines_mm_[cy + 1] - lines_mm_[cy]);
  const std::size_t stride = static_cast<std::size_t>(board_.squares_x) * cells_per_square_ + 1;
  const double* corner = black_area_.data() + static_cast<std::size_t>(cy) * stride + cx;
  return (1.0 - v) * ((1.0 - u) * corner[0] + u * corner[1]) +
         v * ((1.0 - u) * corner[stride] + u * corner[stride + 1]);
}

double BoardPrint::whiteness(double x_mm, double y_mm, double width_mm, double height_mm) const {
  const double left = x_mm + 0.5 * board_.width_mm() - 0.5 * width_mm;
  const double top = 0.5 * board_.height_mm() - y_mm - 0.5 * height_mm;
  const double black = black_area(left + width_mm, top + height_mm) -
                       black_area(left, top + height_mm) - black_area(left + width_mm, top) +
                       black_area(left, top);
  return std::clamp(1.0 - black / (width_mm * height_mm), 0.0, 1.0);
}

}  // namespace skullstation
