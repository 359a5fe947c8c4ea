#pragma once

#include <optional>
#include <vector>

#include "reconstruction/volume/coarse_volume.h"
#include "reconstruction/volume/head_region.h"

namespace skullstation {

/// Where the brain's cavity opens into the spinal canal. Places are in mm from the grid's first
/// voxel along its axes (x left, y posterior, z superior).
struct SpinalCanal {
  Eigen::Vector3d foramen_magnum_mm = Eigen::Vector3d::Zero();
  /// The canal's middle, in steps downwards from the foramen magnum.
  std::vector<Eigen::Vector3d> middle_mm;
  double brain_mm3 = 0.0;  ///< of the ball-shaped core that was found

  /// The canal's middle at a height; straight on below the last place known.
  Eigen::Vector3d middle_at(double z_mm) const;
  /// Unit vector along the uppermost 30 mm of the canal, upwards: how the neck is held. Straight up
  /// where less than 10 mm of it are known.
  Eigen::Vector3d up() const;
};

/// Finds the brain as the largest region of soft tissue more than 16 mm from bone and air, its
/// lowest point above the foramen magnum, and follows the canal from there downwards along its
/// widest places. Nothing if there is no such region: a scan without the cranial cavity.
std::optional<SpinalCanal> find_spinal_canal(const CoarseVolume& coarse, const HeadVoxels& head,
                                             int threads);

}  // namespace skullstation
