#pragma once

#include "core/result.h"
#include "reconstruction/volume/coarse_volume.h"

namespace skullstation {

/// Which coarse voxels belong to the head and neck, and what was found besides.
struct HeadVoxels {
  VoxelMask head;     ///< coarse voxels of tissue (at least half, roughly) that belong to the head
  VoxelMask removed;  ///< tissue-like voxels that don't: head rest, table, cables, clothes
  double removed_mm3 = 0.0;
  /// Where the head touches what was removed: area [mm^2] on the front and the back half.
  double contact_front_mm2 = 0.0;
  double contact_back_mm2 = 0.0;
};

/// Tells the head from what lies round it. The head is the largest body that is left when
/// everything thinner than 12 mm is taken away, with the thin parts that belong to it: those that
/// reach at most 30 mm beyond it, as ears do, where shells and tables reach farther, and those that
/// are walls round a cavity with a narrow opening, as the nose is. Fails with `no_result` where
/// there is no such body.
Result<HeadVoxels> find_head(const CoarseVolume& coarse, int tissue_hu, int threads);

}  // namespace skullstation
