#pragma once

#include <ctime>
#include <string>
#include <vector>

namespace skullstation {

/// Distances of points from a surface, each point counting alike.
struct FitDistances {
  int points = 0;
  double mean_mm = 0.0;
  double rms_mm = 0.0;
  double p95_mm = 0.0;
  double max_mm = 0.0;
};

/// What one stage of a fit did.
struct FitStage {
  std::string name;
  int iterations = 0;
  int correspondences = 0;    ///< in the last iteration
  double rms_mm = 0.0;        ///< of those, after the stage
  double last_move_mm = 0.0;  ///< mean over the vertices, in the last iteration
  double processor_seconds = 0.0;
};

using FitStages = std::vector<FitStage>;

/// Of all the process's threads together, so far.
inline double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace skullstation
