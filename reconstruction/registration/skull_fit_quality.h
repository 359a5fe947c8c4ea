#pragma once

#include <vector>

#include "reconstruction/registration/input_surface.h"
#include "reconstruction/registration/skull_registration.h"

namespace skullstation {

/// Mean, RMS, 95th percentile and maximum of distances [mm].
FitDistances distances_of(std::vector<double> distances_mm);

/// Fills `observed`, `distance_mm` and `quality` of a fit whose vertices lie at `vertices` in the
/// frame of `input`. A vertex of the input counts as facial, or as outer, where it lies on the
/// outside of the input and the nearest point of the fitted surface is facial, or outer.
void measure_skull_fit(const SkullTemplate& skull, const Points3& vertices,
                       const InputSurface& input, int threads, FittedSkull& fitted);

}  // namespace skullstation
