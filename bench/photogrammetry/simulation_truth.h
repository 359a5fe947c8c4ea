#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"
#include "core/transform.h"

namespace skullstation {

/// What a simulated scan really was (docs/simulation.md).
struct SimulationTruth {
  Rigid3 table_from_board;
  Rigid3 table_from_specimen;  ///< in the first pass
  std::map<std::string, Rigid3> camera_from_station;
  std::map<std::string, double> table_angle_deg;  ///< of each image

  /// To the frame of the reconstruction, which has its x axis along the board; on the table the
  /// board lies a little askew.
  Rigid3 reconstruction_from_specimen() const;
};

/// simulation_truth.json of the session's folder.
Result<SimulationTruth> read_simulation_truth(const std::filesystem::path& session);

}  // namespace skullstation
