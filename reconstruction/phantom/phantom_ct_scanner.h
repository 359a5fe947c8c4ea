#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "reconstruction/volume/volume.h"

namespace skullstation {

/// Blurs with a Gaussian of the given SD [mm] along the grid's axes; the border's values go on
/// beyond it.
void blur_volume(std::vector<float>& values, const VoxelGrid& grid, double sd_mm, int threads);

/// Adds balls of metal and the streaks they cause in their slices, `streak_hu` high beside the
/// metal and falling off with the distance.
void add_metal(std::vector<float>& values, const VoxelGrid& grid,
               const std::vector<Eigen::Vector3d>& metal_mm, double streak_hu, int threads);

/// Rounds to whole HU with white noise of the given SD, each voxel from a stream of its own.
std::vector<std::int16_t> noisy_hu(const std::vector<float>& values, const VoxelGrid& grid,
                                   double noise_sd_hu, std::uint64_t seed, int threads);

}  // namespace skullstation
