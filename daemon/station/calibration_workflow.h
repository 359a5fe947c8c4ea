#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/calibration/camera_calibration.h"
#include "core/clock.h"
#include "core/progress.h"
#include "core/result.h"
#include "daemon/station/scan_workflow.h"
#include "daemon/station/station_config.h"

namespace skullstation {

/// Photographs of the hand-held board, and what they were taken with.
struct BoardPictures {
  std::vector<CalibrationView> views;
  int width = 0;
  int height = 0;
  std::string device;
  UtcTime taken;

  void add(std::string name, const Image8& image, const CharucoBoard& board);
};

/// Takes the pictures for the lens of one camera now: the operator holds the board and presses the
/// button for each; the simulated operator holds it as calibration_poses() says. Only that camera
/// is opened, without the calibration that is to be replaced.
Result<BoardPictures> photograph_board(StationConfig config, const std::string& camera_id,
                                       const OperatorPrompts& prompts, std::uint64_t seed,
                                       int threads, const Progress& progress);

/// Fits the lens and puts the camera's name and the pictures' origin into the calibration.
Result<CameraCalibrationReport> calibrate_from(const BoardPictures& pictures,
                                               const CharucoBoard& board,
                                               const std::string& camera_id);

/// Photographs the board and calibrates the lens of every camera that has no calibration yet, and
/// keeps the results in the station's calibration folder. For simulated stations: nobody is told
/// how to hold the board.
Result<void> calibrate_lenses(const StationConfig& config, std::uint64_t seed, int threads,
                              const Progress& progress);

}  // namespace skullstation
