#pragma once

#include <libcamera/controls.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "capture/cameras/camera.h"

namespace skullstation {

/// "ExposureTime" -> "exposure_time".
std::string snake_case(const std::string& camel_case);

/// The camera's scalar controls; `metadata` (of the last frame) gives their present values, the
/// default stands in for what it doesn't tell. Real numbers are in thousandths, "_milli".
std::vector<CameraControl> list_controls(const libcamera::ControlInfoMap& available,
                                         const libcamera::ControlList& metadata);

/// What to start the camera with. Error (kind bad_input): a setting that the camera has not or a
/// value outside its range, naming both.
Result<libcamera::ControlList> controls_for(const libcamera::ControlInfoMap& available,
                                            const CameraSettings& settings,
                                            const std::string& camera);

/// The values that the metadata says were used. Error (kind hardware): it doesn't tell one.
Result<std::vector<LockedSetting>> settings_in_force(const libcamera::ControlList& asked,
                                                     const libcamera::ControlList& metadata,
                                                     const std::string& camera);

std::optional<std::chrono::microseconds> exposure_of(const libcamera::ControlList& metadata);

/// Start of the first line's readout on CLOCK_BOOTTIME, as the sensor's driver stamped it.
std::optional<std::chrono::nanoseconds> sensor_timestamp_of(const libcamera::ControlList& metadata);

std::optional<std::chrono::nanoseconds> frame_duration_of(const libcamera::ControlList& metadata);

}  // namespace skullstation
