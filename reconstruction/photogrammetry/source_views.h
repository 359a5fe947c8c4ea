#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

struct SourceViewOptions {
  int count = 8;  ///< at most, in [1, 8]
  /// Angle between the lines of sight at the specimen's middle [deg].
  double least_angle_deg = 4.0;
  double best_angle_deg = 16.0;
  double most_angle_deg = 45.0;
};

/// For each view the others of its pass that see the specimen from a useful angle, best first: near
/// the best angle, and not all from the same side. May be empty.
std::vector<std::vector<int>> choose_source_views(std::span<const StereoView> views,
                                                  const Eigen::Vector3d& specimen_middle_mm,
                                                  const SourceViewOptions& options);

}  // namespace skullstation
