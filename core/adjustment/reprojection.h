#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace skullstation {

/// Lens::project() for any scalar, with intrinsics fx fy cx cy k1 k2 p1 p2.
template <class T>
Eigen::Matrix<T, 2, 1> project_opencv(const T* intrinsics, const Eigen::Matrix<T, 3, 1>& x_camera) {
  const T x = x_camera.x() / x_camera.z();
  const T y = x_camera.y() / x_camera.z();
  const T r2 = x * x + y * y;
  const T radial = T(1.0) + r2 * (intrinsics[4] + r2 * intrinsics[5]);
  const T& p1 = intrinsics[6];
  const T& p2 = intrinsics[7];
  const T xd = x * radial + T(2.0) * p1 * x * y + p2 * (r2 + T(2.0) * x * x);
  const T yd = y * radial + p1 * (r2 + T(2.0) * y * y) + T(2.0) * p2 * x * y;
  return {intrinsics[0] * xd + intrinsics[2], intrinsics[1] * yd + intrinsics[3]};
}

/// A rotation and translation as Ceres adjusts them: Eigen's quaternion order x y z w.
template <class T>
Eigen::Matrix<T, 3, 1> transformed(const T* rotation, const T* translation,
                                   const Eigen::Matrix<T, 3, 1>& x) {
  const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
  const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t(translation);
  return q * x + t;
}

}  // namespace skullstation
