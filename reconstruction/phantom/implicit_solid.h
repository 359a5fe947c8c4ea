#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>

namespace skullstation {

/// A solid given by its signed distance, negative inside. Safe to evaluate from several threads.
class ImplicitSolid {
 public:
  virtual ~ImplicitSolid() = default;

  /// Signed distance [mm]: zero on the surface, with a gradient of about unit length near it (0.8
  /// in the median for the skull, less where many strokes blend).
  /// Farther off than about 5 mm only the sign and the order of magnitude hold.
  virtual double distance_mm(const Eigen::Vector3d& point) const = 0;

  /// A box that holds the whole solid.
  virtual Eigen::AlignedBox3d bounds() const = 0;

  /// The same solid, quicker to evaluate: inside the ball its distances agree with this one's to
  /// 0.01 mm where those lie within `band_mm` of zero; elsewhere only their sign does. Must not
  /// outlive this one.
  virtual std::unique_ptr<ImplicitSolid> near_ball(const Eigen::Vector3d& center, double radius_mm,
                                                   double band_mm) const = 0;
};

/// Unit outward normal by central differences over +- `step_mm`.
Eigen::Vector3d surface_normal(const ImplicitSolid& solid, const Eigen::Vector3d& point,
                               double step_mm = 0.05);

}  // namespace skullstation
