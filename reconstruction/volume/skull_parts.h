#pragma once

#include <optional>

#include "reconstruction/volume/spinal_canal.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

/// The bones of a mask that make the skull, and what was left out.
struct SkullParts {
  VoxelMask skull;  ///< largest part, and the mandible if it is a part of its own
  int parts_kept = 0;
  int parts_removed = 0;
  bool mandible_apart = false;
};

/// Keeps the largest component (18-connectivity, as the isosurface joins) and a mandible that does
/// not touch it: another part at least 55 mm wide, 40 mm deep and of 4 ml. Hyoid, thyroid,
/// vertebrae and loose inner bone go.
SkullParts find_skull_parts(const VoxelMask& bone, const Eigen::Vector3d& spacing_mm);

/// Where the mandible lies, in mm from the grid's first voxel.
struct MandibleExtent {
  double lowest_z_mm = 0.0;
  /// The most posterior point of the mandible's outlines in the slices (Gietzen et al. 2019).
  Eigen::Vector3d most_posterior_mm = Eigen::Vector3d::Zero();
};

/// Looks for the mandible in the slices below the foramen magnum: outlines that begin at least 40
/// mm in front of the canal. Nothing if they hold less than 5 ml of bone more than 25 mm below.
std::optional<MandibleExtent> find_mandible(const VoxelMask& skull, const SpinalCanal& canal,
                                            const Eigen::Vector3d& spacing_mm);

}  // namespace skullstation
