#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/calibration/calibration_file.h"
#include "capture/cameras/camera.h"
#include "capture/scan/scan_session.h"
#include "core/clock.h"
#include "core/result.h"
#include "daemon/station/simulated_room.h"
#include "daemon/station/station_config.h"
#include "firmware_io/station_hardware.h"

namespace skullstation {

struct StationCamera {
  CameraConfig config;
  std::unique_ptr<Camera> camera;
  std::vector<LockedSetting> locked;
  std::optional<CameraCalibration> calibration;
};

/// A station with everything open and running, real or simulated. Members are destroyed bottom
/// up: cameras and hardware before the room they stand in, the clock last.
struct Station {
  std::unique_ptr<Clock> clock;
  std::unique_ptr<SimulatedRoom> room;  ///< null with real hardware
  StationHardware hardware;
  std::vector<StationCamera> cameras;

  std::vector<ScanCamera> scan_cameras() const;
};

/// What time it is where everything is simulated: a scan that takes no time, or one that a person
/// can follow. Real hardware has real time.
enum class SimulatedTime { virtual_time, real_time };

/// Opens the hardware, then each camera, locks its settings and reads its calibration if there is
/// one. Errors name the part. `seed` and `threads` are the simulation's.
Result<Station> open_station(const StationConfig& config, RoomSetting setting, std::uint64_t seed,
                             int threads, SimulatedTime time = SimulatedTime::virtual_time);

/// One camera of the configuration; `room` is needed for a simulated one.
Result<std::unique_ptr<Camera>> open_camera(const CameraConfig& camera, SimulatedRoom* room,
                                            Clock& clock);

std::filesystem::path camera_calibration_file(const StationConfig& config, const std::string& id);
std::filesystem::path table_calibration_file(const StationConfig& config);

/// "model serial", as calibration files name the device they belong to.
std::string device_name(const Camera& camera);

}  // namespace skullstation
