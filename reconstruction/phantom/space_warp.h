#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "core/transform.h"

namespace skullstation {

/// A smooth deformation of space: an affine map, Gaussian bumps of displacement, and a rigid
/// motion of the result:
///   warped(x) = motion * (x + A x + b + sum_i w_i exp(-|x - c_i|^2 / (2 s_i^2))).
/// Invertible where the bumps are gentle; see least_determinant.
struct SpaceWarp {
  struct Bump {
    Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
    double width_mm = 1.0;  ///< s
    Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  };

  Eigen::Matrix3d stretch = Eigen::Matrix3d::Zero();  ///< A
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  std::vector<Bump> bumps;
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
