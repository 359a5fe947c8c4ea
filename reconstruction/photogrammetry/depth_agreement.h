#pragma once

#include <span>
#include <vector>

#include "reconstruction/photogrammetry/depth_maps.h"

namespace skullstation {

/// For each pixel of `maps[reference]`: how many of its sources confirm its depth, by their own
/// depth there and by where that leads back to (forward-backward consistency, Merrell et al. 2007).
/// The limits are those of the options.
std::vector<std::uint8_t> count_agreement(std::span<const DepthMap> maps, int reference,
                                          const DepthMapOptions& options);

/// Counts the agreement of all maps and takes out the depths that too few views confirm or that
/// match too badly.
void keep_confirmed(std::vector<DepthMap>& maps, const DepthMapOptions& options);

}  // namespace skullstation
