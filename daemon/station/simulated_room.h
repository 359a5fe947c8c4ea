#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "capture/simulation/scene.h"
#include "capture/simulation/simulated_camera.h"
#include "core/clock.h"
#include "core/result.h"
#include "core/triangle_mesh.h"
#include "daemon/station/station_config.h"
#include "firmware_io/simulated_station.h"

namespace skullstation {

/// What stands in the simulated room.
enum class RoomSetting {
  specimen_on_table,  ///< a scan
  bare_table,         ///< `calibrate table`
  board_in_hand,      ///< `calibrate camera`
};

/// Table, specimen and cameras of a simulated station, and the operator's hands. Specimen and
/// board are put down as a person would: a few millimetres and degrees off, drawn from the seed.
class SimulatedRoom {
 public:
  static Result<std::unique_ptr<SimulatedRoom>> build(const StationConfig& config,
                                                      RoomSetting setting, Clock& clock,
                                                      std::uint64_t seed, int threads);

  SimulatedStation& station() { return *station_; }

  /// What the specimen is made of [mm]: the truth for whatever is made of its photographs. Empty on
  /// a bare table.
  const TriangleMesh& specimen() const { return specimen_; }

  /// A camera of the room; the room must outlive it.
  Result<std::unique_ptr<Camera>> open_camera(const CameraConfig& camera);

  /// Lays the specimen down as the pass wants it: 0 upright, 1 turned over, 2 on its back.
  void place_specimen(int pass);
  /// Holds the board before a camera (setting board_in_hand).
  void hold_board(const CameraConfig& camera, const Rigid3& camera_from_board);

  /// Notes where the table really is now, for the picture just written.
  void note_truth(const std::string& image, int pass);
  /// What was noted, with the true cameras and placements, as JSON (docs/simulation.md). Keeps
  /// what an earlier part of the same scan wrote to the file.
  Result<void> write_truth(const std::filesystem::path& file) const;

 private:
  SimulatedRoom(const StationConfig& config, Clock& clock, std::uint64_t seed, int threads);
  Result<void> furnish(RoomSetting setting);
  CameraOptics optics_of(const CameraConfig& camera) const;
  Rigid3 placement(int pass) const;
  std::uint64_t index_of(const std::string& camera_id) const;

  struct NotedView {
    int pass = 0;
    double table_angle_deg = 0.0;
  };

  const StationConfig config_;
  Clock& clock_;
  const std::uint64_t seed_;
  const int threads_;
  std::unique_ptr<SimulatedStation> station_;
  TriangleMesh specimen_;
  std::shared_ptr<SimulatedScene> scene_;
  std::map<std::string, NotedView> noted_;  // by image
};

/// Lens of a simulated camera: the truth that `calibrate camera` is measured against.
Lens simulated_lens(const CameraConfig& camera);

}  // namespace skullstation
