#pragma once

#include <Eigen/Core>

#include "reconstruction/registration/head_template.h"

namespace skullstation {

/// The part of the canonical head (anatomical frame) that a point of its skin belongs to: that of
/// the nearest of some seed points.
HeadRegion head_region_at(const Eigen::Vector3d& point_mm);

}  // namespace skullstation
