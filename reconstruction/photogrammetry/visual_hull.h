#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// The space that no mask forbids (Laurentini 1994), as voxels in the table frame.
struct VisualHull {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< lower corner of voxel (0, 0, 0)
  double voxel_mm = 1.0;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<std::uint8_t> inside;  ///< x fastest

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * size.y() + y) * size.x() + x;
  }
  Eigen::Vector3d centre_mm() const;  ///< of the voxels inside
};

/// Carves the hull on a grid with `resolution` voxels along its longest side. A voxel is cut away
/// as soon as all of it lies outside one view's mask. Views must be of one pass. Fails with
/// `no_result` where nothing is left: masks and poses contradict each other.
Result<VisualHull> carve_visual_hull(std::span<const StereoView> views, int resolution,
                                     int threads);

/// Inverse depths [1/mm] between which each pixel's ray may meet the hull; both 0 where it does
/// not.
struct HullRange {
  int width = 0;
  int height = 0;
  std::vector<float> nearest;   ///< inverse depth where the ray enters: the larger one
  std::vector<float> farthest;  ///< where it leaves at last
};
HullRange hull_range(const VisualHull& hull, const Pinhole& camera,
                     const Rigid3& camera_from_table);

}  // namespace skullstation
