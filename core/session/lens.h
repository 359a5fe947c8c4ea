#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Camera models of COLMAP that sessions may name.
enum class LensModel {
  pinhole,  ///< PINHOLE: fx fy cx cy
  opencv,   ///< OPENCV:  fx fy cx cy k1 k2 p1 p2
};

std::string to_string(LensModel model);
Result<LensModel> lens_model_from_string(const std::string& name);
int parameter_count(LensModel model);

/// Intrinsics in pixels; pixel (0.5, 0.5) is the centre of the top-left pixel. OpenCV's own
/// functions call that point (0, 0): where its cx, cy or image points come in, 0.5 is added.
struct Lens {
  int width = 0;
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0;

  /// \pre `params` has parameter_count(model) entries (std::invalid_argument otherwise).
  static Lens from_params(int width, int height, LensModel model,
                          const std::vector<double>& params);
  /// \pre a lens with distortion is not asked for PINHOLE's (std::invalid_argument otherwise).
  std::vector<double> params(LensModel model) const;

  /// Image point [px] of a point in camera coordinates (z > 0), distortion included.
  Eigen::Vector2d project(const Eigen::Vector3d& x_camera) const;

  /// d px / d x_camera of project() [px per unit of x_camera].
  Eigen::Matrix<double, 2, 3> project_derivative(const Eigen::Vector3d& x_camera) const;

  /// Direction (x, y, 1) of the ray through an image point: distortion undone by Newton
  /// iteration to 1e-10. Nothing where the distortion can't be undone (folded lens).
  std::optional<Eigen::Vector3d> ray(const Eigen::Vector2d& x_px) const;
};

}  // namespace skullstation
