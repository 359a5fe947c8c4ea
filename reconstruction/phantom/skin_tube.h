#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace skullstation {

/// A point on the axis of a tube with the radius of the tube there.
struct TubePoint {
  double center_mm[3];
  double radius_mm;
};

/// A tube: the union of balls whose centres run along a polyline and whose radii change linearly
/// from point to point. A helix of an ear, the slit between the lids and the neck are tubes alike.
class Tube {
 public:
  /// \pre at least two points
  explicit Tube(std::span<const TubePoint> points);

  /// Signed distance [mm], negative inside; exact where the radius is constant, to first order near
  /// the surface elsewhere.
  double distance_mm(const Eigen::Vector3d& point) const;

  Eigen::AlignedBox3d bounds() const { return bounds_; }

 private:
  struct Segment {
    Eigen::Vector3d start;
    Eigen::Vector3d along;  ///< start to end
    double inverse_squared_length = 0.0;
    double start_radius = 0.0;
    double radius_gain = 0.0;
  };

  std::vector<Segment> segments_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace skullstation
