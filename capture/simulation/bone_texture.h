#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "capture/simulation/scene.h"

namespace skullstation {

/// The colour of dry bone as a solid texture: ivory, blotched by low-frequency stains, with
/// speckle at every scale from 8 mm down to 0.2 mm, fine pores, and dark wavy lines where a skull
/// that faces -y with +z up has its coronal, sagittal and lambdoid sutures. A pure function of the
/// point, so that it sticks to the specimen however that lies and from wherever it is seen.
class BoneTexture {
 public:
  BoneTexture(const BoneLook& look, const Eigen::AlignedBox3d& specimen_box);

  /// Linear RGB albedo in [0, 1] at a point in specimen coordinates [mm]; detail finer than
  /// `footprint_mm` is averaged away.
  Eigen::Vector3f albedo(const Eigen::Vector3d& x_specimen, float footprint_mm) const;

 private:
  float suture_depth(const Eigen::Vector3f& x_specimen, float footprint_mm) const;
  float pore_depth(const Eigen::Vector3f& x_specimen, float footprint_mm) const;

  BoneLook look_;
  std::uint32_t seed_;
  Eigen::Vector3f centre_;
  Eigen::Vector3f half_size_;
};

}  // namespace skullstation
