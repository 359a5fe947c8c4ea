#pragma once

#include <Eigen/Core>
#include <optional>

namespace skullstation {

/// Hounsfield units at a point of the canonical head [mm] that lies `depth_mm` under the bone's
/// surface, if a tooth is there with its jaw closed: enamel on the crowns, dentine within and in
/// the roots; nothing elsewhere.
std::optional<double> tooth_hu(const Eigen::Vector3d& canonical, double depth_mm);

}  // namespace skullstation
