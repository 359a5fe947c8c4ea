#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace skullstation {

/// Rotation and translation. Named target_from_source: `camera_from_table * x_table` is the
/// point in camera coordinates, x_camera = R x_table + t [mm].
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
  Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  Rigid3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }
  Eigen::Matrix4d matrix() const;

  /// Top three rows of a 4x4 (or a 3x4) matrix whose left 3x3 part is a rotation.
  static Rigid3 from_matrix(const Eigen::Matrix<double, 3, 4>& matrix);
};

/// x_target = scale * R x_source + t.
struct Similarity3 {
  double scale = 1.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const {
    return scale * (rotation * x) + translation;
  }
  Similarity3 operator*(const Similarity3& other) const {
    return {scale * other.scale, (rotation * other.rotation).normalized(),
            *this * other.translation};
  }
  Similarity3 inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {1.0 / scale, back, -(back * translation) / scale};
  }
  Eigen::Matrix4d matrix() const;
};

/// A transform's matrix row by row, as files carry it.
std::array<std::array<double, 4>, 4> matrix_rows(const Eigen::Matrix4d& matrix);

/// Rotation about +z by `angle_deg`, counter-clockwise seen from +z.
Rigid3 rotation_about_z(double angle_deg);

/// Angle of the rotation between two rigid transforms [deg], in [0, 180].
double rotation_distance_deg(const Rigid3& a, const Rigid3& b);

}  // namespace skullstation
