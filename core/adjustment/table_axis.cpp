#include "core/adjustment/table_axis.h"

#include <Eigen/Geometry>

#include "core/linear_algebra.h"
#include "core/units.h"

namespace skullstation {

Rigid3 TableAxis::table_from_board() const {
  const Eigen::Vector3d origin = board_point_on_table<double>(unknowns.data(), {0.0, 0.0, 0.0});
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 3; ++i) {
    rotation.col(i) =
        board_point_on_table<double>(unknowns.data(), Eigen::Vector3d::Unit(i)) - origin;
  }
  return {Eigen::Quaterniond(rotation).normalized(), origin};
}

std::optional<TableAxis> axis_of_motions(const std::vector<Rigid3>& motions,
                                         double least_turn_deg) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  bool turns = false;
  for (const Rigid3& motion : motions) {
    const Eigen::Vector3d half_sine = motion.rotation.vec();
    if (half_sine.norm() < std::sin(0.5 * radians(least_turn_deg))) continue;
    turns = true;
    // The board lies face up, so that its normal and the axis point to the same side.
    direction += half_sine.z() < 0.0 ? Eigen::Vector3d(-half_sine) : half_sine;
    // Points on the axis stay where they are: (I - R) p = t.
    const Eigen::Matrix3d a = Eigen::Matrix3d::Identity() - motion.rotation.toRotationMatrix();
    normal += a.transpose() * a;
    right += a.transpose() * motion.translation;
  }
  if (!turns || !(direction.z() > 0.5 * direction.norm())) return std::nullopt;
  direction /= direction.z();
  // Along the axis nothing is determined: the smallest solution, moved into the board's plane.
  const SymmetricSpectrum solver = symmetric_spectrum(normal);
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int i = 1; i < 3; ++i) {
    const Eigen::Vector3d v = solver.vectors.col(i);
    point += v * (v.dot(right) / solver.values[i]);
  }
  point -= direction * point.z();
  return TableAxis{{point.x(), point.y(), direction.x(), direction.y()}};
}

}  // namespace skullstation
