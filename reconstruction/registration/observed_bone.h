#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "reconstruction/registration/skull_template.h"

namespace skullstation {

// What of the template's surface (#boundary_count) a fit found on its input.

/// Outer surface vertices that were observed.
std::vector<int> observed_outer(const SkullTemplate& skull, const std::vector<bool>& observed);

/// Share of the template's outer surface that was observed, or of one bone's; 1 of a bone that the
/// template lacks.
double observed_share(const SkullTemplate& skull, const std::vector<bool>& observed,
                      std::optional<SkullBone> bone = std::nullopt);

/// Share of what surrounds each surface vertex (the nearest outer vertices, within about 8 mm on
/// the template) that was observed; 0 for inner vertices. Where it is small although the vertex was
/// observed, another bone came to lie there by chance; where it is large although it was not, there
/// is no break but a foramen that the fit did not find.
Eigen::VectorXd observed_around(const SkullTemplate& skull, const std::vector<bool>& observed);

}  // namespace skullstation
