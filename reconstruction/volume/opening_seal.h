#pragma once

#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

struct OpeningSealOptions {
  /// Openings up to twice this wide are closed: nostrils, ear canals, a slightly open mouth.
  double closing_radius_mm = 6.0;
  /// So deep, from where the closing begins, a dent stays open.
  double depth_mm = 6.0;
};

/// Which voxels the outside air may not enter: cavities behind narrow openings, and the openings
/// beyond a depth. `solid` is the body; a body voxel gets the answer of the air nearest to it, so
/// that the seal holds along the walls too (beyond 3 voxels from any air it is closed).
VoxelMask sealed_from_outside(const VoxelMask& solid, const Eigen::Vector3d& spacing_mm,
                              const OpeningSealOptions& options, int threads);

/// The body with its dents and cavities up to their openings filled, wherever these are at most
/// `opening_mm` wide.
VoxelMask filled_behind_openings(const VoxelMask& solid, const Eigen::Vector3d& spacing_mm,
                                 double opening_mm, int threads);

}  // namespace skullstation
