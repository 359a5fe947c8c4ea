#include "capture/simulation/placement.h"

#include <cmath>

#include "core/units.h"

namespace skullstation {

Eigen::Quaterniond turned_over() { return {0.0, 1.0, 0.0, 0.0}; }

Rigid3 rest_on_table(const TriangleMesh& specimen,
                     const Eigen::Quaterniond& table_rotation_specimen) {
  Eigen::AlignedBox3d box;
  for (Eigen::Index v = 0; v < specimen.vertices.rows(); ++v) {
    box.extend(table_rotation_specimen * Eigen::Vector3d(specimen.vertices.row(v)));
  }
  Rigid3 table_from_specimen;
  table_from_specimen.rotation = table_rotation_specimen;
  if (!box.isEmpty()) {
    table_from_specimen.translation = {-box.center().x(), -box.center().y(), -box.min().z()};
  }
  return table_from_specimen;
}

Rigid3 camera_looking_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  if (forward.cross(up).norm() < 1e-9) up = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = right;
  rotation.row(1) = forward.cross(right);
  rotation.row(2) = forward;
  const Eigen::Quaterniond camera_rotation_station = Eigen::Quaterniond(rotation).normalized();
  return {camera_rotation_station, -(camera_rotation_station * eye)};
}

Rigid3 camera_on_ring(const Eigen::Vector3d& target, double distance_mm, double elevation_deg,
                      double azimuth_deg) {
  const double elevation = radians(elevation_deg);
  const double azimuth = radians(azimuth_deg);
  const Eigen::Vector3d towards_camera(std::cos(elevation) * std::cos(azimuth),
                                       std::cos(elevation) * std::sin(azimuth),
                                       std::sin(elevation));
  return camera_looking_at(target + distance_mm * towards_camera, target);
}

}  // namespace skullstation
