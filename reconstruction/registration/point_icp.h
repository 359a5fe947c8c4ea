#pragma once

#include "core/result.h"
#include "core/transform.h"
#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

struct PointIcpOptions {
  bool estimate_scale = false;
  double max_distance_mm = 10.0;  ///< pairs farther apart do not count
  double max_normal_angle_deg = 45.0;
  int max_iterations = 30;
  double tolerance_mm = 1e-4;  ///< done when the source moves less (RMS)
  int threads = 0;             ///< 0: all

  Result<void> validate() const;
};

/// How well a source lies on a target.
struct PointFit {
  Similarity3 target_from_source;
  double overlap = 0.0;  ///< share of the source's points with a partner
  double rms_mm = 0.0;   ///< point to plane, over those
  int iterations = 0;
};

/// Moves the source, from `start`, onto the planes at the nearest points of the target (Chen &
/// Medioni 1992), pairs weighted down as they are farther apart (Welsch, scale from their median).
/// The target may reach beyond the source. `target_tree` holds the positions of `target`. The same
/// for any number of threads. Fails with `no_result` when too little overlaps.
Result<PointFit> align_points(const OrientedPoints& source, const OrientedPoints& target,
                              const PointTree& target_tree, const Similarity3& start,
                              const PointIcpOptions& options);

}  // namespace skullstation
