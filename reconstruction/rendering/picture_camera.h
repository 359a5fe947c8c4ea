#pragma once

#include <Eigen/Core>
#include <span>

#include "core/triangle_mesh.h"

namespace skullstation {

/// A picture's camera: perspective from `distance_mm` before `target_mm`, as an eye would see it.
struct PictureCamera {
  Eigen::Vector3d target_mm = Eigen::Vector3d::Zero();
  /// Rows: right, up, towards the viewer; unit, right-handed.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  double distance_mm = 1200.0;
  /// The picture's middle and height in the plane through the target, facing the viewer.
  Eigen::Vector2d middle_mm = Eigen::Vector2d::Zero();
  double height_mm = 100.0;

  Eigen::Vector3d eye() const { return target_mm + distance_mm * axes.row(2).transpose(); }

  /// The point of that plane seen at (u, v) in [-1/2, 1/2], u to the right in units of the
  /// picture's height, v upwards.
  Eigen::Vector3d in_plane(double u, double v) const {
    return target_mm + (middle_mm.x() + u * height_mm) * axes.row(0).transpose() +
           (middle_mm.y() + v * height_mm) * axes.row(1).transpose();
  }
};

/// A camera that sees all meshes from the direction `from` (out of their common middle towards the
/// viewer) with `up` upwards, filling a picture of width / height = `aspect` but for a margin.
/// \pre `from` and `up` are not parallel; there is a vertex
PictureCamera look_at(std::span<const TriangleMesh* const> meshes, const Eigen::Vector3d& from,
                      const Eigen::Vector3d& up, double aspect);

}  // namespace skullstation
