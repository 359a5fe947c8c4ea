#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/transform.h"

namespace skullstation {

/// Where the turning axis passes through the board: the point on it in the board's plane [mm] and
/// the direction (x, y, 1), in the board frame. Together with "x along the board's x at angle 0"
/// this is the board's pose on the platter.
struct TableAxis {
  std::array<double, 4> unknowns{};  ///< point x, point y, direction x, direction y

  /// x along the board's x, z along the axis, origin where it passes the board's plane.
  Rigid3 table_from_board() const;
};

/// x_table of a point of the board; `axis` as TableAxis::unknowns.
template <class T>
Eigen::Matrix<T, 3, 1> board_point_on_table(const T* axis, const Eigen::Matrix<T, 3, 1>& x_board) {
  using Vector3 = Eigen::Matrix<T, 3, 1>;
  const Vector3 z = Vector3(axis[2], axis[3], T(1.0)).normalized();
  const Vector3 board_x(T(1.0), T(0.0), T(0.0));
  const Vector3 x = (board_x - z * z.x()).normalized();
  const Vector3 y = z.cross(x);
  const Vector3 from_origin = x_board - Vector3(axis[0], axis[1], T(0.0));
  return {x.dot(from_origin), y.dot(from_origin), z.dot(from_origin)};
}

/// The point after the table turned, counter-clockwise seen from above.
template <class T>
Eigen::Matrix<T, 3, 1> turned(const T& angle_rad, const Eigen::Matrix<T, 3, 1>& x_table) {
  using std::cos;
  using std::sin;
  const T c = cos(angle_rad);
  const T s = sin(angle_rad);
  return {c * x_table.x() - s * x_table.y(), s * x_table.x() + c * x_table.y(), x_table.z()};
}

/// The axis that all motions of the board (in its own frame) turn about. Motions of less than
/// `least_turn_deg` don't count; nothing if all are, or if they turn about anything but an axis
/// that stands on the board.
std::optional<TableAxis> axis_of_motions(const std::vector<Rigid3>& motions, double least_turn_deg);

}  // namespace skullstation
