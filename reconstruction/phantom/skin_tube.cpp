#include "reconstruction/phantom/skin_tube.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace skullstation {

Tube::Tube(std::span<const TubePoint> points) {
  assert(points.size() >= 2);
  for (const TubePoint& point : points) {
    const Eigen::Vector3d center(point.center_mm);
    const Eigen::Vector3d radius = Eigen::Vector3d::Constant(point.radius_mm);
    bounds_.extend(Eigen::AlignedBox3d(center - radius, center + radius));
  }
  for (std::size_t i = 1; i < points.size(); ++i) {
    Segment segment;
    segment.start = Eigen::Vector3d(points[i - 1].center_mm);
    segment.along = Eigen::Vector3d(points[i].center_mm) - segment.start;
    segment.inverse_squared_length = 1.0 / segment.along.squaredNorm();
    segment.start_radius = points[i - 1].radius_mm;
    segment.radius_gain = points[i].radius_mm - points[i - 1].radius_mm;
    segments_.push_back(segment);
  }
}

double Tube::distance_mm(const Eigen::Vector3d& point) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Segment& segment : segments_) {
    const Eigen::Vector3d offset = point - segment.start;
    const double share =
        std::clamp(offset.dot(segment.along) * segment.inverse_squared_length, 0.0, 1.0);
    const double distance = (offset - share * segment.along).norm() - segment.start_radius -
                            share * segment.radius_gain;
    least = std::min(least, distance);
  }
  return least;
}

}  // namespace skullstation
