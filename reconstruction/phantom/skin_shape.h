#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "reconstruction/phantom/implicit_solid.h"
#include "reconstruction/phantom/skin_tables.h"

namespace skullstation {

/// The solid within the skin: rough forms blended together, a sum of dabs, fine features, and the
/// neck cut off in a plane. Exactly symmetric in x = 0.
class SkinShape final : public ImplicitSolid {
 public:
  /// The neck ends at `neck_z_mm`.
  SkinShape(std::span<const TubeRow> rough_forms, std::span<const Dab> dabs,
            std::span<const TubeRow> features, double neck_z_mm);

  double distance_mm(const Eigen::Vector3d& point) const override;
  Eigen::AlignedBox3d bounds() const override { return bounds_; }
  std::unique_ptr<ImplicitSolid> near_ball(const Eigen::Vector3d& center, double radius_mm,
                                           double band_mm) const override;

 private:
  struct Form {
    Tube tube;
    bool carve = false;
    bool paired = false;
    double blend_mm = 0.0;

    explicit Form(const TubeRow& row);
    /// `left`: the point or its mirror image, whichever has x >= 0
    double distance_mm(const Eigen::Vector3d& left) const;
  };
  /// One of the two images of a dab.
  struct Push {
    Eigen::Vector3d center;
    double inverse_squared_radius = 0.0;
    double height_mm = 0.0;
    double radius_mm = 0.0;
  };

  SkinShape() = default;

  std::vector<Form> rough_forms_;
  std::vector<Push> pushes_;
  std::vector<Form> features_;
  double neck_z_mm_ = 0.0;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace skullstation
