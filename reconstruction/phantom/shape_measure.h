#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace skullstation {

/// A number taken from the positions of a few points, such as a length between two landmarks.
struct ShapeMeasure {
  std::string name;
  std::vector<int> points;  ///< indices of the points it is taken from
  /// Gets those points in that order.
  std::function<double(std::span<const Eigen::Vector3d> points)> value;
};

/// Distance between two points [mm].
ShapeMeasure length_measure(std::string name, int a, int b);
/// Mean of a coordinate (0: x, 1: y, 2: z) over the points [mm].
ShapeMeasure coordinate_measure(std::string name, std::vector<int> of, int axis);
/// Distance from a fixed point [mm].
ShapeMeasure reach_measure(std::string name, int point, const Eigen::Vector3d& fixed);

double measured(const ShapeMeasure& measure, std::span<const Eigen::Vector3d> all_points);

/// Derivative with respect to each of the measure's points, by central differences (3 x points).
Eigen::Matrix3Xd measure_gradient(const ShapeMeasure& measure,
                                  std::span<const Eigen::Vector3d> all_points);

}  // namespace skullstation
