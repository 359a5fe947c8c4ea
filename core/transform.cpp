#include "core/transform.h"

#include "core/units.h"

namespace skullstation {

Eigen::Matrix4d Rigid3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Rigid3 Rigid3::from_matrix(const Eigen::Matrix<double, 3, 4>& matrix) {
  return {Eigen::Quaterniond(Eigen::Matrix3d(matrix.leftCols<3>())).normalized(), matrix.col(3)};
}

Eigen::Matrix4d Similarity3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = scale * rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

std::array<std::array<double, 4>, 4> matrix_rows(const Eigen::Matrix4d& matrix) {
  std::array<std::array<double, 4>, 4> rows{};
  for (std::size_t r = 0; r < 4; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      rows[r][c] = matrix(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
    }
  }
  return rows;
}

Rigid3 rotation_about_z(double angle_deg) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(radians(angle_deg), Eigen::Vector3d::UnitZ())),
          Eigen::Vector3d::Zero()};
}

double rotation_distance_deg(const Rigid3& a, const Rigid3& b) {
  return degrees(a.rotation.angularDistance(b.rotation));
}

}  // namespace skullstation
