#pragma once

#include <Eigen/Core>

#include "reconstruction/volume/volume.h"

namespace skullstation {

/// A head of ellipsoids and tubes whose surfaces are known exactly, in patient coordinates [mm]
/// about the brain's middle. Distances are negative inside; exact near the surfaces, where it
/// matters.
struct HeadWithDistances {
  static double from_skin_mm(const Eigen::Vector3d& p);
  /// Skull and mandible, diploe filled.
  static double from_skull_mm(const Eigen::Vector3d& p);

  /// Its CT: blurred as by a scanner (standard deviation 0.4 mm in the slices, slices as thick as
  /// they are far apart), with noise of `noise_hu`.
  static Volume scan(const VoxelGrid& grid, double noise_hu, std::uint64_t seed, int threads);
};

}  // namespace skullstation
