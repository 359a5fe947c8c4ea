#include "reconstruction/phantom/skin_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruction/phantom/stroke.h"

namespace skullstation {

namespace {

Eigen::Vector3d mirrored(const Eigen::Vector3d& point) {
  return {-point.x(), point.y(), point.z()};
}

/// Dabs beside one another may add up to steep slopes away from the surface; what says "nothing
/// near" must not say so too early.
double cautious_mm(double distance_mm) {
  constexpr double kTrusted_mm = 3.0;
  const double beyond_mm = std::max(std::abs(distance_mm) - kTrusted_mm, 0.0);
  return distance_mm - std::copysign(0.5 * beyond_mm, distance_mm);
}

}  // namespace

SkinShape::Form::Form(const TubeRow& row)
    : tube(row.points),
      carve(row.tool == TubeRow::Tool::carve),
      paired(row.paired),
      blend_mm(row.blend_mm) {}

double SkinShape::Form::distance_mm(const Eigen::Vector3d& left) const {
  const double distance = tube.distance_mm(left);
  return paired ? std::min(distance, tube.distance_mm(mirrored(left))) : distance;
}

SkinShape::SkinShape(std::span<const TubeRow> rough_forms, std::span<const Dab> dabs,
                     std::span<const TubeRow> features, double neck_z_mm)
    : neck_z_mm_(neck_z_mm) {
  double highest_mm = 0.0;
  for (const TubeRow& row : rough_forms) {
    rough_forms_.emplace_back(row);
    Eigen::AlignedBox3d box = rough_forms_.back().tube.bounds();
    if (row.paired) box.extend(Eigen::AlignedBox3d(mirrored(box.max()), mirrored(box.min())));
    bounds_.extend(box);
  }
  for (const Dab& dab : dabs) {
    Push push;
    push.center = Eigen::Vector3d(dab.center_mm);
    push.inverse_squared_radius = 1.0 / (dab.radius_mm * dab.radius_mm);
    push.height_mm = dab.height_mm;
    push.radius_mm = dab.radius_mm;
    highest_mm = std::max(highest_mm, dab.height_mm);
    pushes_.push_back(push);
  }
  for (const TubeRow& row : features) features_.emplace_back(row);
  bounds_.min().array() -= highest_mm;
  bounds_.max().array() += highest_mm;
  bounds_.min().z() = neck_z_mm;
}

double SkinShape::distance_mm(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d left(std::abs(point.x()), point.y(), point.z());
  const Eigen::Vector3d right = mirrored(left);
  double distance = std::numeric_limits<double>::max();
  for (const Form& form : rough_forms_) {
    distance = smooth_minimum(distance, form.distance_mm(left), form.blend_mm);
  }
  for (const Push& push : pushes_) {
    const auto add = [&](const Eigen::Vector3d& at) {
      const double fall = 1.0 - (at - push.center).squaredNorm() * push.inverse_squared_radius;
      if (fall > 0.0) distance -= push.height_mm * fall * fall * fall;
    };
    add(left);
    if (push.center.x() != 0.0) add(right);
  }
  for (const Form& form : features_) {
    const double tube = form.distance_mm(left);
    distance = form.carve ? -smooth_minimum(-distance, tube, form.blend_mm)
                          : smooth_minimum(distance, tube, form.blend_mm);
  }
  return cautious_mm(std::max(distance, neck_z_mm_ - point.z()));
}

std::unique_ptr<ImplicitSolid> SkinShape::near_ball(const Eigen::Vector3d& center, double radius_mm,
                                                    double band_mm) const {
  std::unique_ptr<SkinShape> near(new SkinShape());
  near->rough_forms_ = rough_forms_;
  near->neck_z_mm_ = neck_z_mm_;
  near->bounds_ = bounds_;
  const Eigen::Vector3d left(std::abs(center.x()), center.y(), center.z());
  for (const Push& push : pushes_) {
    const double reach_mm = push.radius_mm + radius_mm;
    if ((left - push.center).squaredNorm() < reach_mm * reach_mm ||
        (mirrored(left) - push.center).squaredNorm() < reach_mm * reach_mm) {
      near->pushes_.push_back(push);
    }
  }
  for (const Form& form : features_) {
    // Within the band of zero a feature is felt where it is nearer than its blend and the band.
    const Eigen::AlignedBox3d box = form.tube.bounds();
    const double distance_mm =
        std::min(box.exteriorDistance(left), box.exteriorDistance(mirrored(left)));
    if (distance_mm < radius_mm + band_mm + form.blend_mm) near->features_.push_back(form);
  }
  return near;
}

}  // namespace skullstation
