#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/image.h"
#include "core/result.h"

namespace skullstation {

/// One picture. 1 channel (grey) or 3 (RGB), 8 bits.
struct Frame {
  Image8 image;
  Instant exposure_start;  ///< no light was collected before this moment (conservative)
  std::uint32_t sequence = 0;
  std::optional<std::chrono::microseconds> exposure;  ///< as reported by the device
};

struct CameraDescription {
  std::string backend;      ///< "v4l2", "libcamera", "simulated", "replay"
  std::string model;        ///< as the device says: "HD Pro Webcam C920"
  std::string serial;       ///< empty if it has none
  std::string stable_path;  ///< finds the same device again after a re-plug
  std::string format;       ///< what is streamed: "YUYV 1600x1200 stride 3200"
};

/// A setting in the device's own units. `name` is the device's name in lower case with
/// underscores ("exposure_time_absolute").
struct CameraControl {
  std::string name;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::int64_t step = 1;
  std::int64_t default_value = 0;
  std::int64_t value = 0;
  bool read_only = false;
};

/// What every scan locks, so that all views are comparable. Unset: left as the device has it.
struct CameraSettings {
  std::optional<std::chrono::microseconds> exposure = {};
  std::optional<double> gain = {};          ///< 1 = none
  std::optional<int> white_balance_k = {};  ///< colour temperature
  std::optional<double> focus = {};         ///< 0 far … 1 near
};

/// A setting that was locked: what was asked for and what the device says is in force.
struct LockedSetting {
  std::string control;
  std::int64_t asked = 0;
  std::int64_t in_force = 0;
};

/// A camera that streams. Made running by its backend's open function; the destructor stops it.
/// After an error of kind `hardware`, reopen() is the way back. Not thread-safe.
class Camera {
 public:
  virtual ~Camera() = default;

  virtual CameraDescription description() const = 0;

  /// The first good frame whose exposure began at or after `not_before`. Older frames and frames
  /// that the device flags as damaged are discarded, so no caller can ever use a stale one.
  /// Errors (kind hardware): time-out (nothing good within `timeout`), unplugged, stream broken;
  /// kind cancelled on a stop request.
  virtual Result<Frame> frame_after(Instant not_before, std::chrono::milliseconds timeout,
                                    std::stop_token stop) = 0;

  virtual Result<std::vector<CameraControl>> controls() = 0;

  /// Switches automatics off, sets, reads back. A setting that the device has not is an error
  /// that names it; the value in force may differ from the one asked (device granularity).
  virtual Result<std::vector<LockedSetting>> lock(const CameraSettings& settings) = 0;

  /// Closes and opens the same device again by its stable path, with the settings last locked.
  virtual Result<void> reopen() = 0;
};

}  // namespace skullstation
