#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace skullstation {

/// Points of the board's plane and where the image shows them.
struct Correspondences {
  std::vector<Eigen::Vector2d> board_mm;
  std::vector<Eigen::Vector2d> image_px;

  /// A marker's four corners.
  void add(const Eigen::Matrix<double, 4, 2>& board, const Eigen::Matrix<double, 4, 2>& image) {
    for (int i = 0; i < 4; ++i) {
      board_mm.emplace_back(board.row(i).transpose());
      image_px.emplace_back(image.row(i).transpose());
    }
  }
};

/// How a part of the board's plane maps to the image:
/// px = hnormalized(matrix * ((mm - origin) / scale, 1)).
struct Homography {
  Eigen::Matrix3d matrix;
  Eigen::Vector2d origin_mm;
  double scale_mm = 1.0;

  Eigen::Vector2d operator()(const Eigen::Vector2d& mm) const {
    return (matrix * scaled(mm).homogeneous()).hnormalized();
  }
  /// d px / d mm.
  Eigen::Matrix2d jacobian(const Eigen::Vector2d& mm) const {
    const Eigen::Vector3d h = matrix * scaled(mm).homogeneous();
    const Eigen::Vector2d px = h.hnormalized();
    Eigen::Matrix2d j;
    for (int axis = 0; axis < 2; ++axis) {
      j.col(axis) = (matrix.col(axis).head<2>() - px * matrix(2, axis)) / (h.z() * scale_mm);
    }
    return j;
  }

 private:
  Eigen::Vector2d scaled(const Eigen::Vector2d& mm) const { return (mm - origin_mm) / scale_mm; }
};

/// Least squares: affine for fewer than six points (perspective would fit their noise), else the
/// direct linear transform with normalised points (Hartley 1997). Nothing for points on a line.
std::optional<Homography> fit_homography(const Correspondences& points);

}  // namespace skullstation
