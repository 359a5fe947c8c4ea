#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "reconstruction/photogrammetry/masks_evidence.h"

namespace skullstation {

/// The space where the specimen may be, after a vote of all views of one pass.
struct VoteHull {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< lower corner of voxel (0, 0, 0)
  double voxel_mm = 1.0;
  int side = 0;                      ///< voxels along each side
  std::vector<std::uint8_t> inside;  ///< x fastest

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * side + y) * side + x;
  }
};

struct VoteOptions {
  int side = 160;  ///< voxels along each side of what all cameras look at
  /// So many views, and this share of those that see a voxel, must call it background before it
  /// goes: a single one may be wrong in a dark orbit, or show something else.
  int least_votes = 2;
  double least_share = 0.06;
  /// Nothing lower belongs to the specimen, where a board defines the table's plane.
  std::optional<double> floor_mm;
  int threads = 0;
};

/// Fails with `no_result` where nothing is left or the cameras look past each other.
Result<VoteHull> vote_hull(std::span<const MaskView> views,
                           std::span<const Image<MaskEvidence>> evidence,
                           const VoteOptions& options);

/// Where the view sees the hull: 255 or 0, at the evidence's size.
Image8 hull_silhouette(const VoteHull& hull, const MaskView& view);

}  // namespace skullstation
