#pragma once

#include <vector>

#include "core/session/charuco_board.h"
#include "reconstruction/photogrammetry/poses.h"

namespace skullstation::testing {

/// A station whose truth is known, seen as the corners of its board: two cameras on rings at 15
/// and 45 deg, a round specimen that hides a part of the board.
struct PoseScene {
  int views_per_ring = 12;
  int passes = 1;
  double noise_px = 0.05;      ///< of each coordinate
  double angle_sd_deg = 0.03;  ///< the table's, against the angle it was told
  double wobble_mm = 0.0;      ///< of the platter, from stop to stop
  std::uint64_t seed = 1;
};

struct PoseSceneTruth {
  CharucoBoard board;
  std::vector<PoseCamera> cameras;        ///< with the true lenses
  std::vector<PoseObservation> views;     ///< corners with noise, commanded angles
  std::vector<Rigid3> camera_from_table;  ///< of each view
};

PoseSceneTruth make_pose_scene(const PoseScene& scene);

/// Largest distance between true and found camera centres over the views used [mm].
double worst_position_mm(const PoseSceneTruth& truth, const PoseResult& result);
double worst_rotation_deg(const PoseSceneTruth& truth, const PoseResult& result);

/// How many times too large the found cameras' ring is, in percent, signed.
double scale_error_percent(const PoseSceneTruth& truth, const PoseResult& result);

}  // namespace skullstation::testing
