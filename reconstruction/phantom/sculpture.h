#pragma once

#include <memory>
#include <span>
#include <vector>

#include "reconstruction/phantom/implicit_solid.h"
#include "reconstruction/phantom/stroke.h"

namespace skullstation {

/// The solid that a list of strokes makes, one applied after the other.
class Sculpture final : public ImplicitSolid {
 public:
  explicit Sculpture(std::span<const Stroke> strokes);

  double distance_mm(const Eigen::Vector3d& point) const override;
  Eigen::AlignedBox3d bounds() const override { return bounds_; }
  std::unique_ptr<ImplicitSolid> near_ball(const Eigen::Vector3d& center, double radius_mm,
                                           double band_mm) const override;

 private:
  explicit Sculpture(std::vector<StrokeShape> shapes);

  std::vector<StrokeShape> shapes_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace skullstation
