#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/photogrammetry/depth_maps.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// Points along a block's edge; block b owns the grid points [8 b, 8 b + 8) on each axis.
inline constexpr int kFusionBlock = 8;
inline constexpr int kFusionPoints = kFusionBlock * kFusionBlock * kFusionBlock;

struct FusionBlock {
  Eigen::Vector3i at = Eigen::Vector3i::Zero();
  std::array<float, kFusionPoints> distance_mm{};  ///< positive outside the specimen; x fastest
  std::array<float, kFusionPoints> weight{};       ///< of the depths near by; 0: unseen
};

/// Truncated signed distances to the surface, at grid points i * voxel_mm of the table frame, in
/// those blocks that come near it.
struct FusionVolume {
  double voxel_mm = 0.5;
  std::vector<FusionBlock> blocks;  ///< sorted by z, y, x of `at`

  /// Index of the block at these block coordinates, or -1.
  int find(const Eigen::Vector3i& at) const;
};

struct FusionOptions {
  double voxel_mm = 0.5;
  double truncation_voxels = 3.0;  ///< Curless & Levoy 1996
  /// Weight of a view that looks through a point, relative to one that sees the surface there:
  /// what takes out floating pieces and bridges.
  double free_space_weight = 0.3;
  double least_weight =
      0.05;  ///< a grid point counts as seen above it; 1: a confirmed frontal view
  int threads = 0;

  Result<void> validate() const;
};

/// Fuses depth maps into signed distances (Curless & Levoy 1996), each depth as the plane that
/// stereo found there, weighted by its confidence and by how frontally it was seen. Behind a
/// surface the weight falls to 0 over the truncation, so that thin walls keep their two sides;
/// before it, and where the mask shows background, a view votes for empty space. The same bytes
/// for any number of threads. Fails with `no_result` if there is no depth at all, `cancelled` on
/// request.
Result<FusionVolume> fuse_depth_maps(std::span<const DepthMap> maps,
                                     std::span<const StereoView> views,
                                     const FusionOptions& options, const Progress& progress);

}  // namespace skullstation
