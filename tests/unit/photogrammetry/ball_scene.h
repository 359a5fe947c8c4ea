#pragma once

#include <vector>

#include "reconstruction/photogrammetry/depth_maps.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// A ball with a fine solid texture, photographed by a ring of pinhole cameras that look at it.
struct BallScene {
  Eigen::Vector3d centre_mm{3.0, -2.0, 40.0};
  double radius_mm = 30.0;
  int views = 18;
  int width = 140;
  int height = 110;
  double focal_px = 420.0;
  double distance_mm = 260.0;
  double elevation_deg = 25.0;

  /// Depth along z of the ball's surface through a pixel; 0 beside it.
  double depth_mm(const Pinhole& camera, const Rigid3& camera_from_table, double x_px,
                  double y_px) const;
};

/// The scene's photographs with masks; averages over 3 x 3 rays a pixel.
std::vector<StereoView> photograph(const BallScene& scene);

/// Depth maps without error, confirmed by all.
std::vector<DepthMap> true_depth_maps(const BallScene& scene, std::span<const StereoView> views);

}  // namespace skullstation
