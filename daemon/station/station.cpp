#include "daemon/station/station.h"

#include <fmt/format.h>

#include <algorithm>

#include "capture/cameras/libcamera_camera.h"
#include "capture/cameras/replay_camera.h"
#include "capture/cameras/v4l2_camera.h"

namespace skullstation {

namespace {

/// Virtual time, as long as nothing real takes part.
bool all_simulated(const StationConfig& config) {
  return config.backend == StationBackend::simulated &&
         std::all_of(config.cameras.begin(), config.cameras.end(), [](const CameraConfig& camera) {
           return camera.backend == CameraBackend::simulated ||
                  camera.backend == CameraBackend::replay;
         });
}

bool has_settings(const CameraSettings& settings) {
  return settings.exposure || settings.gain || settings.white_balance_k || settings.focus;
}

tl::unexpected<Error> with_camera(const CameraConfig& camera, Error error) {
  error.where =
      fmt::format("camera \"{}\"{}{}", camera.id, error.where.empty() ? "" : ", ", error.where);
  return tl::unexpected(std::move(error));
}

Result<std::optional<CameraCalibration>> calibration_of(const StationConfig& config,
                                                        const CameraConfig& camera) {
  const auto file = camera_calibration_file(config, camera.id);
  if (!std::filesystem::exists(file)) return std::nullopt;
  auto calibration = read_camera_calibration(file);
  if (!calibration) return forward(calibration);
  if (calibration->lens.width != camera.width || calibration->lens.height != camera.height) {
    return fail(
        ErrorKind::bad_input, file.string(),
        fmt::format("was made for {}x{} pixels, the camera is set to {}x{}",
                    calibration->lens.width, calibration->lens.height, camera.width, camera.height),
        fmt::format("run `skullstation calibrate camera --camera {}`", camera.id));
  }
  return *std::move(calibration);
}

Result<StationCamera> open_station_camera(const StationConfig& config, const CameraConfig& camera,
                                          SimulatedRoom* room, Clock& clock) {
  StationCamera opened{camera, nullptr, {}, std::nullopt};
  auto device = open_camera(camera, room, clock);
  if (!device) return with_camera(camera, device.error());
  opened.camera = *std::move(device);
  if (has_settings(camera.settings)) {
    auto locked = opened.camera->lock(camera.settings);
    if (!locked) return with_camera(camera, locked.error());
    opened.locked = *std::move(locked);
  }
  auto calibration = calibration_of(config, camera);
  if (!calibration) return forward(calibration);
  opened.calibration = *std::move(calibration);
  return opened;
}

}  // namespace

std::vector<ScanCamera> Station::scan_cameras() const {
  std::vector<ScanCamera> list;
  for (const StationCamera& station_camera : cameras) {
    std::optional<Lens> lens;
    if (station_camera.calibration) lens = station_camera.calibration->lens;
    list.push_back({station_camera.config.id, *station_camera.camera, lens,
                    station_camera.config.focal_length_mm});
  }
  return list;
}

Result<std::unique_ptr<Camera>> open_camera(const CameraConfig& camera, SimulatedRoom* room,
                                            Clock& clock) {
  switch (camera.backend) {
    case CameraBackend::simulated:
      if (room == nullptr) break;
      return room->open_camera(camera);
    case CameraBackend::v4l2: {
      V4l2CameraConfig config;
      config.device = camera.device;
      config.format.size = FrameSize{camera.width, camera.height};
      if (!camera.format.empty()) config.format.format = camera.format;
      config.gain_steps_per_unit = camera.gain_steps_per_unit;
      return open_v4l2_camera(config);
    }
    case CameraBackend::libcamera: {
      LibcameraConfig config;
      config.id = camera.device;
      config.size = FrameSize{camera.width, camera.height};
      return open_libcamera_camera(config);
    }
    case CameraBackend::replay: {
      const auto pictures = pictures_in(camera.device);
      if (!pictures) return forward(pictures);
      return open_replay_camera({*pictures, false}, clock);
    }
  }
  return fail(ErrorKind::bad_input, "backend",
              "a simulated camera needs the simulated station around it",
              "set station.backend = \"simulated\" or another camera backend");
}

Result<Station> open_station(const StationConfig& config, RoomSetting setting, std::uint64_t seed,
                             int threads, SimulatedTime time) {
  Station station;
  if (all_simulated(config) && time == SimulatedTime::virtual_time) {
    station.clock = std::make_unique<SimulatedClock>();
  } else {
    station.clock = std::make_unique<SystemClock>();
  }
  if (config.backend == StationBackend::simulated) {
    auto room = SimulatedRoom::build(config, setting, *station.clock, seed, threads);
    if (!room) return forward(room);
    station.room = *std::move(room);
    station.hardware = station.room->station().hardware();
  } else {
    auto hardware = open_gpio_station(config.gpio, config.turntable, *station.clock);
    if (!hardware) return forward(hardware);
    station.hardware = *std::move(hardware);
  }
  for (const CameraConfig& camera : config.cameras) {
    auto opened = open_station_camera(config, camera, station.room.get(), *station.clock);
    if (!opened) return forward(opened);
    station.cameras.push_back(*std::move(opened));
  }
  return station;
}

std::filesystem::path camera_calibration_file(const StationConfig& config, const std::string& id) {
  return std::filesystem::path(config.calibration_folder) / ("camera-" + id + ".json");
}

std::filesystem::path table_calibration_file(const StationConfig& config) {
  return std::filesystem::path(config.calibration_folder) / "table.json";
}

std::string device_name(const Camera& camera) {
  const CameraDescription description = camera.description();
  return description.serial.empty() ? description.model
                                    : description.model + " " + description.serial;
}

}  // namespace skullstation
