#pragma once

#include <Eigen/Core>

#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// The part of the canonical skull (anatomical frame) that a point of the bone belongs to: that of
/// the nearest of some seed points.
SkullRegion skull_region_at(const Eigen::Vector3d& point_mm, SkullBone bone);

}  // namespace skullstation
