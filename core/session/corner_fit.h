#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/image.h"

namespace skullstation {

/// Where a chessboard corner is expected and what its neighbourhood must look like.
struct ExpectedCorner {
  Eigen::Vector2d position_px;
  Eigen::Matrix2d px_from_mm;  ///< how the board's x and y run in the image, around the corner
  bool first_quadrant_white;   ///< the square at +x, +y of the corner; else it is black
  double free_mm = 0.0;        ///< from the squares' edges to the nearest marker
  double ring_mm = 0.0;        ///< width of the black ring around a marker's bits
  double square_mm = 0.0;
  double max_shift_px = 0.0;  ///< farther from the expected position is another corner
};

struct FittedCorner {
  Eigen::Vector2d position_px;
  double unexplained = 0.0;  ///< share of the pixels' variance that the fitted picture leaves
};

/// Fits the picture of a chessboard corner to the pixels around the expected position: two
/// straight edges that cross and the markers' black corners beside them, blurred by a Gaussian,
/// under light that changes linearly (least squares, Levenberg-Marquardt). Only a cross of pixels
/// along the edges is used, so that the markers' bits have no say. Nothing where the pixels don't
/// look like that: a hidden, cut off or washed-out corner.
std::optional<FittedCorner> fit_corner(const Image8& grey, const ExpectedCorner& expected);

}  // namespace skullstation
