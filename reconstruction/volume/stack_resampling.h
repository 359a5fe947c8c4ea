#pragma once

#include "reconstruction/volume/slice_stack.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// Undoes the gantry's tilt: shifts every slice in its plane to where the patient was (cubic
/// convolution, Keys 1981), so that the axes are at right angles. `volume` holds the slices in the
/// stack's order as if there were no tilt; the planes grow to hold what the shift moves out, filled
/// with air (-1000 HU).
Volume straightened(const Volume& volume, const SliceStack& stack);

/// Interpolates slices at uneven heights linearly at steps of the smallest gap.
Volume evenly_spaced(const Volume& volume, const SliceStack& stack);

}  // namespace skullstation
