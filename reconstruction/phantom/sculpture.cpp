#include "reconstruction/phantom/sculpture.h"

#include <algorithm>
#include <utility>

namespace skullstation {

namespace {

/// Distance to nothing: farther than any part of a head.
constexpr double kFar_mm = 1e3;

Eigen::AlignedBox3d bounds_of_added(const std::vector<StrokeShape>& shapes) {
  Eigen::AlignedBox3d box;
  for (const StrokeShape& shape : shapes) {
    if (shape.stroke().tool == Stroke::Tool::carve) continue;
    // A smooth union swells beyond its parts by at most a quarter of the blend.
    Eigen::AlignedBox3d reach = shape.bounds();
    const Eigen::Vector3d swelling = Eigen::Vector3d::Constant(0.25 * shape.stroke().blend_mm);
    box.extend(Eigen::AlignedBox3d(reach.min() - swelling, reach.max() + swelling));
  }
  return box;
}

}  // namespace

Eigen::Vector3d surface_normal(const ImplicitSolid& solid, const Eigen::Vector3d& point,
                               double step_mm) {
  Eigen::Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = step_mm * Eigen::Vector3d::Unit(axis);
    gradient[axis] = solid.distance_mm(point + step) - solid.distance_mm(point - step);
  }
  return gradient.normalized();
}

Sculpture::Sculpture(std::span<const Stroke> strokes)
    : Sculpture(std::vector<StrokeShape>(strokes.begin(), strokes.end())) {}

Sculpture::Sculpture(std::vector<StrokeShape> shapes)
    : shapes_(std::move(shapes)), bounds_(bounds_of_added(shapes_)) {}

double Sculpture::distance_mm(const Eigen::Vector3d& point) const {
  double distance = kFar_mm;
  for (const StrokeShape& shape : shapes_) {
    const Stroke& stroke = shape.stroke();
    const bool carve = stroke.tool == Stroke::Tool::carve;
    // Beyond its reach a stroke changes nothing.
    const double reach_mm = carve ? stroke.blend_mm - distance : stroke.blend_mm + distance;
    const double form = shape.distance_below_mm(point, reach_mm);
    if (form >= reach_mm) continue;
    distance = carve ? -smooth_minimum(-distance, form, stroke.blend_mm)
                     : smooth_minimum(distance, form, stroke.blend_mm);
  }
  return distance;
}

std::unique_ptr<ImplicitSolid> Sculpture::near_ball(const Eigen::Vector3d& center, double radius_mm,
                                                    double band_mm) const {
  // Backwards, for what a stroke does is felt through the blends of the near ones after it. A chain
  // of blends carries farther than the widest of them, yet by less than the promised 0.01 mm.
  std::vector<StrokeShape> near;
  double widest_later_blend_mm = 0.0;
  for (auto shape = shapes_.rbegin(); shape != shapes_.rend(); ++shape) {
    const double blend_mm = shape->stroke().blend_mm;
    const double reach_mm = band_mm + 1.25 * (blend_mm + widest_later_blend_mm);
    if (shape->lower_bound_mm(center, radius_mm) >= reach_mm) continue;
    widest_later_blend_mm = std::max(widest_later_blend_mm, blend_mm);
    near.push_back(*shape);
  }
  std::reverse(near.begin(), near.end());
  return std::unique_ptr<ImplicitSolid>(new Sculpture(std::move(near)));
}

}  // namespace skullstation
