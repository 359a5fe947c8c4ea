#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/cameras/camera.h"
#include "capture/cameras/v4l2_device.h"

namespace skullstation {

/// "Exposure Time, Absolute" -> "exposure_time_absolute".
std::string control_name(std::string_view device_name);

/// The device's whole-number controls (integers, switches, menus, bit masks) with their values.
/// Left out: compound controls, texts, buttons, disabled ones, and those that can't be read.
Result<std::vector<CameraControl>> list_v4l2_controls(const V4l2Device& device);

/// Switches the automatics off that stand in the way, sets, reads back. Units:
/// - exposure: exposure_time_absolute counts 100 us;
/// - gain: V4L2 leaves the unit to the device. Gain 1 is the control's minimum; any other gain
///   needs `gain_steps_per_unit`, how many steps raise the gain by 1;
/// - white balance: kelvin;
/// - focus: 0 is the control's minimum (far), 1 its maximum (near), as V4L2 orders it.
/// Errors: kind bad_input for a setting that the device has not or a value outside its range,
/// naming both; kind hardware if the device refuses or keeps an automatic on.
Result<std::vector<LockedSetting>> lock_v4l2_controls(const V4l2Device& device,
                                                      const CameraSettings& settings,
                                                      std::optional<double> gain_steps_per_unit);

/// The exposure time if it is set by hand; nothing if automatic or unknown.
std::optional<std::chrono::microseconds> manual_exposure(const V4l2Device& device);

}  // namespace skullstation
