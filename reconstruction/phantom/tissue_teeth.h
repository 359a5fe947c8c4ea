#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/transform.h"

namespace skullstation {

/// Hounsfield units at a point of the canonical skull [mm] that lies `depth_mm` under the bone's
/// surface, if a tooth is there: enamel on the crowns, dentine within; nothing elsewhere. The lower
/// teeth are where the turned jaw has them.
std::optional<double> tooth_hu(const Eigen::Vector3d& canonical, const Rigid3& closed_from_open,
                               double depth_mm);

}  // namespace skullstation
