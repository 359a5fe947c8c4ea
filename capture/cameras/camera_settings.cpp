#include "capture/cameras/camera_settings.h"

#include <fmt/format.h>

namespace skullstation {

CameraSettings overlaid(CameraSettings settings, const CameraSettings& changes) {
  if (changes.exposure) settings.exposure = changes.exposure;
  if (changes.gain) settings.gain = changes.gain;
  if (changes.white_balance_k) settings.white_balance_k = changes.white_balance_k;
  if (changes.focus) settings.focus = changes.focus;
  return settings;
}

Result<void> check_settings(const CameraSettings& settings) {
  const auto refuse = [](std::string setting, std::string what) -> Result<void> {
    return fail(ErrorKind::bad_input, std::move(setting), std::move(what));
  };
  if (settings.exposure && settings.exposure->count() <= 0) {
    return refuse("exposure",
                  fmt::format("is {} us, expected more than 0", settings.exposure->count()));
  }
  if (settings.gain && !(*settings.gain >= 1.0)) {
    return refuse("gain", fmt::format("is {}, expected 1 (none) or more", *settings.gain));
  }
  if (settings.white_balance_k && *settings.white_balance_k <= 0) {
    return refuse("white_balance_k",
                  fmt::format("is {}, expected kelvin", *settings.white_balance_k));
  }
  if (settings.focus && !(*settings.focus >= 0.0 && *settings.focus <= 1.0)) {
    return refuse("focus", fmt::format("is {}, expected 0 (far) to 1 (near)", *settings.focus));
  }
  return {};
}

}  // namespace skullstation
