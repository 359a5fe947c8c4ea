#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/transform.h"

namespace skullstation {

/// How many times larger the second set of camera poses is than the first, from the spread of
/// their centres about their mean (Horn 1987). Nothing for fewer than three poses or centres that
/// lie within `least_spread_mm` of their mean.
std::optional<double> scale_between(const std::vector<Rigid3>& first,
                                    const std::vector<Rigid3>& second, double least_spread_mm);

}  // namespace skullstation
