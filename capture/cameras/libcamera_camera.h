#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/cameras/camera.h"
#include "capture/cameras/v4l2_format.h"

namespace skullstation {

/// A camera on the CSI connector (Raspberry Pi and others), which only libcamera can drive. USB
/// cameras are better served by V4L2: libcamera gives them neither white balance nor focus.
struct LibcameraConfig {
  std::string id = {};  ///< as list_libcamera_cameras() says; empty: the only one there
  std::optional<FrameSize> size = {};  ///< unset: as the camera proposes for still pictures
  bool allow_other_size = false;       ///< take the size that libcamera makes of it
  int buffers = 4;                     ///< [2, 32]
  int settle_frames = 3;  ///< discarded after the start, until settings reach the sensor

  Result<void> validate() const;
};

struct LibcameraInfo {
  std::string id;     ///< stays the same for a camera on the same connector
  std::string model;  ///< "imx477"
};

/// Every camera that libcamera finds. Error (kind hardware): this build has no libcamera, or it
/// can't be started.
Result<std::vector<LibcameraInfo>> list_libcamera_cameras();

/// Opens and starts a camera. lock() restarts the stream with the settings and waits until the
/// frames' own metadata tells which are in force; a frame made with another exposure is discarded.
/// Settings are reported as exposure_time [us], analogue_gain_milli, colour_temperature [K] and
/// lens_position_milli [1/1000 dioptre].
/// Errors (kind hardware): this build has no libcamera, no such camera, busy, no usable format;
/// another size than asked.
Result<std::unique_ptr<Camera>> open_libcamera_camera(const LibcameraConfig& config);

}  // namespace skullstation
