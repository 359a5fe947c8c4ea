#include "reconstruction/phantom/shape_measure.h"

#include <utility>

namespace skullstation {

using Eigen::Vector3d;

namespace {

std::vector<Vector3d> points_of(const ShapeMeasure& measure, std::span<const Vector3d> all_points) {
  std::vector<Vector3d> points;
  points.reserve(measure.points.size());
  for (const int index : measure.points) points.push_back(all_points[index]);
  return points;
}

}  // namespace

ShapeMeasure length_measure(std::string name, int a, int b) {
  return {std::move(name), {a, b}, [](std::span<const Vector3d> points) {
            return (points[0] - points[1]).norm();
          }};
}

ShapeMeasure coordinate_measure(std::string name, std::vector<int> of, int axis) {
  return {std::move(name), std::move(of), [axis](std::span<const Vector3d> points) {
            double sum = 0.0;
            for (const Vector3d& point : points) sum += point[axis];
            return sum / static_cast<double>(points.size());
          }};
}

ShapeMeasure reach_measure(std::string name, int point, const Vector3d& fixed) {
  return {std::move(name), {point}, [fixed](std::span<const Vector3d> points) {
            return (points[0] - fixed).norm();
          }};
}

double measured(const ShapeMeasure& measure, std::span<const Vector3d> all_points) {
  return measure.value(points_of(measure, all_points));
}

Eigen::Matrix3Xd measure_gradient(const ShapeMeasure& measure,
                                  std::span<const Vector3d> all_points) {
  constexpr double kStep_mm = 1e-4;
  std::vector<Vector3d> points = points_of(measure, all_points);
  Eigen::Matrix3Xd gradient(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double at = points[i][axis];
      points[i][axis] = at + kStep_mm;
      const double above = measure.value(points);
      points[i][axis] = at - kStep_mm;
      const double below = measure.value(points);
      points[i][axis] = at;
      gradient(axis, static_cast<Eigen::Index>(i)) = (above - below) / (2.0 * kStep_mm);
    }
  }
  return gradient;
}

}  // namespace skullstation
