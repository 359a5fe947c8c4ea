#pragma once

#include <memory>
#include <optional>
#include <string>

#include "capture/cameras/camera.h"
#include "capture/cameras/v4l2_discovery.h"
#include "capture/cameras/v4l2_format.h"
#include "capture/cameras/v4l2_system.h"

namespace skullstation {

struct V4l2CameraConfig {
  /// "/dev/v4l/by-id/...", "/dev/v4l/by-path/...", "/dev/video0" or "bus:..." (stable_path_of()).
  std::string device = {};
  V4l2FormatRequest format = {};
  /// Asked of the driver, which may grant more or fewer [2, 32].
  int buffers = 4;
  /// Frames discarded after the start and after lock(), until the settings have reached the sensor:
  /// UVC cameras take up to three.
  int settle_frames = 3;
  /// Steps of the device's gain control that raise the gain by 1; unset: only gain 1 can be locked.
  std::optional<double> gain_steps_per_unit = {};

  Result<void> validate() const;
};

/// A camera of the kernel's Video4Linux2 interface (USB cameras above all), streaming into
/// memory-mapped buffers. Errors: see find_node(), V4l2Device::open(), negotiate_format(),
/// V4l2Stream::start().
Result<std::unique_ptr<Camera>> open_v4l2_camera(const V4l2CameraConfig& config);

/// The same on a given system: the kernel's or a scripted one.
Result<std::unique_ptr<Camera>> open_v4l2_camera(const V4l2CameraConfig& config,
                                                 std::shared_ptr<V4l2System> system);

}  // namespace skullstation
