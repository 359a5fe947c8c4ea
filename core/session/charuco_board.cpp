#include "core/session/charuco_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/session/board_pattern.h"

namespace skullstation {

namespace {

int white_square_count(const CharucoBoard& board) { return board.squares_x * board.squares_y / 2; }

/// Adds `level` times the part of each pixel that the rectangle covers, so that cells which tile
/// the page make an exactly area-sampled picture.
void add_rectangle(ImageF& image, double left, double top, double right, double bottom,
                   float level) {
  const auto covered = [](double low, double high, int pixel) {
    return std::min(high, pixel + 1.0) - std::max(low, static_cast<double>(pixel));
  };
  const int end_x = std::min(image.width, static_cast<int>(std::ceil(right)));
  const int end_y = std::min(image.height, static_cast<int>(std::ceil(bottom)));
  for (int y = static_cast<int>(top); y < end_y; ++y) {
    for (int x = static_cast<int>(left); x < end_x; ++x) {
      const double part = covered(top, bottom, y) * covered(left, right, x);
      image.at(x, y) += static_cast<float>(level * part);
    }
  }
}

}  // namespace

Result<void> CharucoBoard::validate() const {
  const auto bad = [](std::string what, std::string advice) {
    return fail(ErrorKind::bad_input, "board", std::move(what), std::move(advice));
  };
  const auto markers = marker_dictionary(dictionary);
  if (!markers) {
    return bad(fmt::format("dictionary \"{}\" is not known", dictionary),
               "use an ArUco dictionary's name such as DICT_5X5_1000");
  }
  if (squares_x < 3 || squares_y < 3 || squares_x > 200 || squares_y > 200) {
    return bad(fmt::format("{} x {} squares; a board has 3 to 200 each way", squares_x, squares_y),
               "count the squares of the printed board, black and white");
  }
  if (!(marker_mm > 0.0) || !(square_mm > marker_mm) || !std::isfinite(square_mm)) {
    return bad(fmt::format("squares of {} mm with markers of {} mm; markers must be smaller than "
                           "squares, and both larger than 0",
                           square_mm, marker_mm),
               "measure the printed board with a ruler");
  }
  if (white_square_count(*this) > markers->size) {
    return bad(fmt::format("{} x {} squares need {} markers, {} has {}", squares_x, squares_y,
                           white_square_count(*this), dictionary, markers->size),
               "use a larger dictionary or fewer squares");
  }
  return {};
}

Eigen::Vector3d CharucoBoard::corner(int id) const {
  const int column = id % (squares_x - 1) + 1;
  const int row = id / (squares_x - 1) + 1;
  return {column * square_mm - 0.5 * width_mm(), 0.5 * height_mm() - row * square_mm, 0.0};
}

std::vector<BoardMarker> board_markers(const CharucoBoard& board) {
  std::vector<BoardMarker> markers;
  markers.reserve(white_square_count(board));
  for (int row = 0; row < board.squares_y; ++row) {
    for (int column = (row + 1) % 2; column < board.squares_x; column += 2) {
      markers.push_back({static_cast<int>(markers.size()), column, row});
    }
  }
  return markers;
}

Eigen::Matrix<double, 4, 2> marker_corners(const CharucoBoard& board, const BoardMarker& marker) {
  const double margin = 0.5 * (board.square_mm - board.marker_mm);
  const double left = marker.column * board.square_mm + margin - 0.5 * board.width_mm();
  const double top = 0.5 * board.height_mm() - marker.row * board.square_mm - margin;
  const double right = left + board.marker_mm;
  const double bottom = top - board.marker_mm;
  Eigen::Matrix<double, 4, 2> corners;
  corners << left, top, right, top, right, bottom, left, bottom;
  return corners;
}

Image8 draw_board(const CharucoBoard& board, int pixels_per_square) {
  const double square = pixels_per_square;
  ImageF page(board.squares_x * pixels_per_square, board.squares_y * pixels_per_square, 1);
  const MarkerDictionary dictionary = marker_dictionary(board.dictionary).value();
  const double margin = square * 0.5 * (1.0 - board.marker_mm / board.square_mm);
  const double cell = (square - 2.0 * margin) / (dictionary.bits + 2);
  for (const BoardMarker& marker : board_markers(board)) {
    const double left = marker.column * square;
    const double top = marker.row * square;
    const double inner_left = left + margin;
    const double inner_top = top + margin;
    const double inner_right = left + square - margin;
    const double inner_bottom = top + square - margin;
    add_rectangle(page, left, top, left + square, inner_top, 255.0F);
    add_rectangle(page, left, inner_bottom, left + square, top + square, 255.0F);
    add_rectangle(page, left, inner_top, inner_left, inner_bottom, 255.0F);
    add_rectangle(page, inner_right, inner_top, left + square, inner_bottom, 255.0F);
    const Image8 bits = marker_bits(dictionary, marker.id);
    for (int y = 0; y < bits.height; ++y) {
      for (int x = 0; x < bits.width; ++x) {
        if (bits.at(x, y) == 0) continue;
        add_rectangle(page, inner_left + (x + 1) * cell, inner_top + (y + 1) * cell,
                      inner_left + (x + 2) * cell, inner_top + (y + 2) * cell, 255.0F);
      }
    }
  }
  Image8 drawn(page.width, page.height, 1);
  std::transform(page.pixels.begin(), page.pixels.end(), drawn.pixels.begin(), [](float level) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0F, 255.0F)));
  });
  return drawn;
}

}  // namespace skullstation
