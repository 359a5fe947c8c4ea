#pragma once

#include <vector>

#include "reconstruction/volume/coarse_volume.h"
#include "reconstruction/volume/head_region.h"
#include "reconstruction/volume/metal_streaks.h"
#include "reconstruction/volume/opening_seal.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// The head as one solid body and the field whose isosurface is its outside.
struct SkinField {
  VoxelMask solid;
  std::vector<std::int16_t> hu;  ///< the scan's own values wherever the skin is the body's outside
};

struct SkinFieldOptions {
  int tissue_hu = -200;
  int metal_hu = 2000;
  double longest_spike_mm = 3.0;
  OpeningSealOptions seal;
};

/// Takes away what is not the head, evens out metal streaks, closes nostrils, mouth and ear canals
/// and fills all inner air, so that what is left has one outside. Where a plug or a cut makes the
/// surface instead of skin, it is smoothed over about 1.5 mm.
SkinField skin_field(const Volume& volume, const CoarseVolume& coarse, const VoxelMask& head,
                     const std::vector<StreakedSlices>& streaks, const SkinFieldOptions& options,
                     int threads);

}  // namespace skullstation
