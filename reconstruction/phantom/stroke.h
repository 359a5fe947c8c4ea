#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace skullstation {

/// One touch of the modelling tool: a simple form that is added to or carved out of what the
/// strokes before it made, with a smooth transition. The unit of our implicit anatomy.
struct Stroke {
  enum class Tool { add, carve };
  enum class Form {
    ellipsoid,  ///< semi-axes `half_size_mm`
    slab        ///< box with semi-axes `half_size_mm` and edges rounded by `rounding_mm`
  };

  Tool tool = Tool::add;
  Form form = Form::ellipsoid;
  bool paired = false;  ///< also as its mirror image in the midsagittal plane x = 0
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_size_mm = Eigen::Vector3d::Ones();
  Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();  ///< rotation vector: axis times angle
  double rounding_mm = 0.0;  ///< slab only, at most the least semi-axis
  double blend_mm = 1.0;     ///< width of the smooth transition to the strokes before it
};

/// Minimum of two distances with a transition of width `blend`: equal to min(a, b) where
/// |a - b| >= blend, C1 everywhere (polynomial smooth minimum, Quilez 2013). Never above min.
inline double smooth_minimum(double a, double b, double blend) {
  const double gap = a < b ? b - a : a - b;
  const double least = a < b ? a : b;
  if (gap >= blend) return least;
  const double h = 1.0 - gap / blend;
  return least - 0.25 * blend * h * h;
}

/// A stroke made ready for evaluation.
class StrokeShape {
 public:
  explicit StrokeShape(const Stroke& stroke);

  /// Signed distance [mm] to the form (both mirror images of a paired one), negative inside.
  /// Exact for slabs; for ellipsoids exact on the surface and to first order near it, and never
  /// below the distance to the enclosing box.
  double distance_mm(const Eigen::Vector3d& point) const;

  /// The same, or infinity where the distance is plainly at least `cutoff_mm`: much quicker far
  /// off.
  double distance_below_mm(const Eigen::Vector3d& point, double cutoff_mm) const;

  /// Lower bound of the distance from any point of the ball to the form.
  double lower_bound_mm(const Eigen::Vector3d& center, double radius_mm) const;

  const Stroke& stroke() const { return stroke_; }

  /// Bounding box of the form, mirror image included.
  Eigen::AlignedBox3d bounds() const;

 private:
  double one_sided_mm(const Eigen::Vector3d& point, double cutoff_mm) const;
  double box_distance_mm(const Eigen::Vector3d& local) const;

  Stroke stroke_;
  Eigen::Matrix3d local_from_model_;
  Eigen::Vector3d inverse_size_;
  Eigen::Vector3d inverse_size_squared_;
  int shortest_axis_ = 0;
  double enclosing_radius_mm_ = 0.0;
};

}  // namespace skullstation
