#include "reconstruction/phantom/stroke.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.h"

namespace skullstation {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Vector3d mirrored(const Eigen::Vector3d& point) {
  return {-point.x(), point.y(), point.z()};
}

}  // namespace

StrokeShape::StrokeShape(const Stroke& stroke)
    : stroke_(stroke),
      local_from_model_(Eigen::Matrix3d::Identity()),
      inverse_size_(stroke.half_size_mm.cwiseInverse()),
      inverse_size_squared_(inverse_size_.cwiseProduct(inverse_size_)) {
  stroke.half_size_mm.minCoeff(&shortest_axis_);
  enclosing_radius_mm_ = stroke.half_size_mm.norm();
  const double angle_deg = stroke.rotation_deg.norm();
  if (angle_deg > 0.0) {
    local_from_model_ =
        Eigen::AngleAxisd(-radians(angle_deg), stroke.rotation_deg / angle_deg).toRotationMatrix();
  }
}

double StrokeShape::box_distance_mm(const Eigen::Vector3d& local) const {
  return (local.cwiseAbs() - stroke_.half_size_mm).cwiseMax(0.0).norm();
}

double StrokeShape::one_sided_mm(const Eigen::Vector3d& point, double cutoff_mm) const {
  const Eigen::Vector3d offset = point - stroke_.center_mm;
  const double clear_mm = cutoff_mm + enclosing_radius_mm_;
  if (clear_mm <= 0.0 || offset.squaredNorm() >= clear_mm * clear_mm) return kInfinity;
  const Eigen::Vector3d local = local_from_model_ * offset;
  if (stroke_.form == Stroke::Form::slab) {
    const Eigen::Vector3d q =
        local.cwiseAbs() - stroke_.half_size_mm + Eigen::Vector3d::Constant(stroke_.rounding_mm);
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - stroke_.rounding_mm;
  }
  // f / |grad f| for f = |p / size| - 1, scaled by |p / size| (Quilez 2008).
  const double k0 = local.cwiseProduct(inverse_size_).norm();
  const double k1 = local.cwiseProduct(inverse_size_squared_).norm();
  if (k0 < 1e-6) return -stroke_.half_size_mm[shortest_axis_];
  const double estimate = k0 * (k0 - 1.0) / k1;
  if (k0 > 1.0) return std::max(estimate, box_distance_mm(local));
  // Deep inside a flat ellipsoid the estimate is far too deep; the way out along the shortest axis
  // bounds it.
  const double least = stroke_.half_size_mm[shortest_axis_];
  const double along = std::abs(local[shortest_axis_]);
  const double way_out = std::sqrt(least * least * (1.0 - k0 * k0) + along * along) - along;
  return std::max(estimate, -way_out);
}

double StrokeShape::distance_mm(const Eigen::Vector3d& point) const {
  return distance_below_mm(point, kInfinity);
}

double StrokeShape::distance_below_mm(const Eigen::Vector3d& point, double cutoff_mm) const {
  if (!stroke_.paired) return one_sided_mm(point, cutoff_mm);
  // Of two images that blend the nearer one decides how far off the other still matters.
  const Eigen::Vector3d left(std::abs(point.x()), point.y(), point.z());
  const Eigen::Vector3d near = stroke_.center_mm.x() < 0.0 ? mirrored(left) : left;
  const double first = one_sided_mm(near, cutoff_mm + stroke_.blend_mm);
  const double second = one_sided_mm(mirrored(near), std::min(cutoff_mm, first) + stroke_.blend_mm);
  if (first == kInfinity && second == kInfinity) return kInfinity;
  return smooth_minimum(first, second, stroke_.blend_mm);
}

double StrokeShape::lower_bound_mm(const Eigen::Vector3d& center, double radius_mm) const {
  double distance = box_distance_mm(local_from_model_ * (center - stroke_.center_mm));
  if (stroke_.paired) {
    // The smooth minimum of the two images lies at most a quarter of the blend below the lesser.
    distance = std::min(distance, box_distance_mm(local_from_model_ *
                                                  (mirrored(center) - stroke_.center_mm))) -
               0.25 * stroke_.blend_mm;
  }
  return distance - radius_mm;
}

Eigen::AlignedBox3d StrokeShape::bounds() const {
  const Eigen::Vector3d reach =
      local_from_model_.transpose().cwiseAbs() * stroke_.half_size_mm +
      Eigen::Vector3d::Constant(stroke_.paired ? 0.25 * stroke_.blend_mm : 0.0);
  Eigen::AlignedBox3d box(stroke_.center_mm - reach, stroke_.center_mm + reach);
  if (stroke_.paired) {
    const Eigen::Vector3d other = mirrored(stroke_.center_mm);
    box.extend(Eigen::AlignedBox3d(other - reach, other + reach));
  }
  return box;
}

}  // namespace skullstation
