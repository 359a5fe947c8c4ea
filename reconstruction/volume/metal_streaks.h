#pragma once

#include <vector>

#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

/// A stack of slices spoilt by streaks from metal in the teeth, with the sound ones next to it.
struct StreakedSlices {
  int first = 0;
  int last = 0;

  /// The nearest sound slices; -1 or the number of slices where there is none.
  int below() const { return first - 1; }
  int above() const { return last + 1; }
};

/// Slices with metal in them (at least 15 mm^2 at or above `metal_hu`) whose soft tissue is rougher
/// than in the nearest slices without: mean step between neighbours in a row at least 1.15 times
/// theirs.
std::vector<StreakedSlices> find_streaks(const Volume& volume, int metal_hu, int threads);

/// Takes streaks off a bone mask: in streaked slices, bone within 45 mm of metal is kept only where
/// one of the sound slices next to the stack has bone within `longest_spike_mm`, and 0.1 mm more
/// for every mm between the slices, since bone may lean.
void remove_bone_streaks(const Volume& volume, int metal_hu,
                         const std::vector<StreakedSlices>& streaks, double longest_spike_mm,
                         VoxelMask& bone);

/// Evens out the head's outline in streaked slices near metal: between the sound slices on either
/// side it follows the interpolation of their outlines (Raya & Udupa 1990) within
/// `longest_spike_mm`. `solid` is the head without inner air.
void limit_skin_streaks(const Volume& volume, int metal_hu,
                        const std::vector<StreakedSlices>& streaks, double longest_spike_mm,
                        VoxelMask& solid);

}  // namespace skullstation
