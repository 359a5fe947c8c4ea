#pragma once

#include "capture/cameras/pixel_format.h"
#include "core/image.h"

namespace skullstation {

/// Full-colour image (3 channels) from a Bayer mosaic (1 channel, both sides at least 2 px) by the
/// gradient-corrected linear 5x5 filters of Malvar, He & Cutler 2004, "High-quality linear
/// interpolation for demosaicing of Bayer-patterned color images", ICASSP. The samples' own colour
/// is kept as measured; interpolated values are clamped to [0, maximum]. Borders are mirrored
/// about the outermost row and column, which keeps the pattern's phase.
Image16 demosaic(const Image16& mosaic, BayerOrder order, int maximum);

}  // namespace skullstation
