#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "core/session/session.h"

namespace skullstation {

enum class PhotographFormat { png, jpeg };

/// What a scan photographs, as pure data: one ring of views per camera, each ring once in every
/// pass. Cameras at different heights are different rings; a higher ring may do with fewer views.
struct ScanPlan {
  std::vector<SessionPlan::Ring> rings;
  int passes = 2;  ///< placements of the specimen: upright, turned over
  PhotographFormat image_format = PhotographFormat::png;
  int jpeg_quality = 95;  ///< 1..100

  Result<void> validate() const;
  SessionPlan record() const { return {rings, passes}; }
};

/// One picture to be taken.
struct PlannedView {
  int pass = 0;
  int ring = 0;  ///< index into ScanPlan::rings
  double table_angle_deg = 0.0;
  std::string image;  ///< path inside the session: images/p0_c0_000.png (pass, ring, view)
};

/// The table stands still, every camera that has a view at this angle takes it.
struct ScanStop {
  double table_angle_deg = 0.0;
  std::vector<PlannedView> views;
};

/// The stops of one pass in the order of least turning: once round, counter-clockwise, from where
/// homing ends (0 deg). That is also the turntable's own direction of approach, so no stop costs a
/// backlash overshoot.
std::vector<ScanStop> stops_of_pass(const ScanPlan& plan, int pass);

/// Every picture of the plan, in the order it is taken.
std::vector<PlannedView> planned_views(const ScanPlan& plan);

}  // namespace skullstation
