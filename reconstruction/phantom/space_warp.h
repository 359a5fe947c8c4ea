#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "core/transform.h"

namespace skullstation {

/// Gaussian bumps of one width on a cubic grid: node (i, j, k) lies at origin + spacing (i, j, k).
/// A Gaussian is the product of one along each axis, so that a whole grid is summed with as many
/// exponentials as it has nodes along its axes.
struct BumpGrid {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  double spacing_mm = 1.0;
  double width_mm = 1.0;                           ///< standard deviation
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< nodes along each axis, at most 64
  Eigen::Matrix3Xd displacement_mm;                ///< of every node, i fastest

  /// The bumps' heights of one at `point`, along one axis.
  Eigen::VectorXd heights(int axis, const Eigen::Vector3d& point) const;
};

/// A smooth deformation of space: an affine map, Gaussian bumps of displacement, and a rigid
/// motion of the result:
///   warped(x) = motion * (x + A x + b + sum_i w_i exp(-|x - c_i|^2 / (2 s_i^2))).
/// Invertible where the bumps are gentle; see least_determinant.
struct SpaceWarp {
  Eigen::Matrix3d stretch = Eigen::Matrix3d::Zero();  ///< A
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  std::vector<BumpGrid> bumps;
  Rigid3 motion;  ///< target_from_warped

  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const;
  /// Derivative of the warped point with respect to the point.
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& point) const;
  /// The point that is warped to `target`, to 1e-6 mm, by damped Newton steps; none where they
  /// don't settle.
  std::optional<Eigen::Vector3d> source_of(const Eigen::Vector3d& target) const;
};

/// Least determinant of the warp's Jacobian on a grid of `spacing_mm` over the box: above zero the
/// warp folds nowhere (between grid points it changes little if the spacing is well below the
/// bumps' widths). Near 1 a warp keeps volumes.
double least_determinant(const SpaceWarp& warp, const Eigen::AlignedBox3d& box, double spacing_mm,
                         int threads);

}  // namespace skullstation
