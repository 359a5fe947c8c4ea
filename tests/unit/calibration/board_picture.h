#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/image.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation::testing {

/// A photograph of a printed board with everything known about it.
struct BoardPicture {
  Lens lens;
  Rigid3 camera_from_board;
  double black = 30.0;  ///< grey levels of ink, paper and what is behind the board
  double white = 210.0;
  double background = 110.0;
  double blur_px = 0.6;   ///< standard deviation
  double noise_sd = 0.0;  ///< grey levels
  int samples = 4;        ///< per pixel, each way
  /// Factor on the light at a point of the image [px].
  std::function<double(double, double)> light = [](double, double) { return 1.0; };
  /// True where something hides the board, by image point [px].
  std::function<bool(double, double)> hidden = [](double, double) { return false; };
};

/// The picture with area sampling of the exactly projected, exactly distorted board.
Image8 photograph(const BoardPicture& picture, const CharucoBoard& board, std::uint64_t seed = 1);

/// Pose of a camera `distance_mm` from the board's point `target_mm` (board plane), seen from
/// `elevation_deg` above the board's plane, from `azimuth_deg` (0: from -y, the page's bottom),
/// rolled about its axis.
Rigid3 camera_looking_at(const Eigen::Vector2d& target_mm, double distance_mm, double elevation_deg,
                         double azimuth_deg, double roll_deg = 0.0);

/// Image points of all corners by id.
std::vector<Eigen::Vector2d> true_corners(const BoardPicture& picture, const CharucoBoard& board);

}  // namespace skullstation::testing
