#pragma once

#include <vector>

#include "core/session/charuco_board.h"

namespace skullstation {

/// The print of a ChArUco board as what it is: black and white rectangles. Holds the integral of
/// its whiteness from the page's top left to every corner of a rectangle, so that the mean over a
/// rectangle of any size is exact and takes four look-ups (Crow 1984, summed-area tables, on an
/// uneven grid). Sampling never blurs or shifts an edge.
class BoardPrint {
 public:
  explicit BoardPrint(const CharucoBoard& board);

  /// Share of white in the rectangle of the given size around (x, y) of the board frame [mm]. What
  /// lies beyond the squares is white.
  double whiteness(double x_mm, double y_mm, double width_mm, double height_mm) const;

 private:
  /// Black area between the page's top left and the point (right, down from there) [mm^2].
  double black_area(double right_mm, double down_mm) const;
  int cell(double along_mm, int squares) const;

  CharucoBoard board_;
  int cells_per_square_;
  std::vector<double> lines_mm_;    // where cells begin, from 0; covers the longer side
  std::vector<double> black_area_;  // (cells down + 1) x (cells right + 1), row-major
};

}  // namespace skullstation
