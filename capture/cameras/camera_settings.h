#pragma once

#include "capture/cameras/camera.h"

namespace skullstation {

/// `settings` with every value that `changes` sets replaced: what is locked after both were.
CameraSettings overlaid(CameraSettings settings, const CameraSettings& changes);

/// Refuses what no camera can mean (kind bad_input, naming the setting): an exposure of 0 or less,
/// a gain below 1, a focus outside 0..1, a white balance that is not positive.
Result<void> check_settings(const CameraSettings& settings);

}  // namespace skullstation
