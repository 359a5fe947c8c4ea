#include "capture/cameras/v4l2_controls.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>

namespace skullstation {
namespace {

using std::chrono::microseconds;

constexpr std::int64_t kExposureUnitUs = 100;
/// Stops an enumeration that a broken driver never ends.
constexpr int kMostControls = 1024;

struct Control {
  std::uint32_t id = 0;
  std::uint32_t type = 0;
  std::uint32_t flags = 0;
  CameraControl description;  // without value
};

Control control_from(const v4l2_query_ext_ctrl& query) {
  Control control{query.id, query.type, query.flags, {}};
  control.description.name = control_name(query.name);
  control.description.minimum = query.minimum;
  control.description.maximum = query.maximum;
  control.description.step = std::max<std::int64_t>(1, static_cast<std::int64_t>(query.step));
  control.description.default_value = query.default_value;
  control.description.read_only = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
  return control;
}

bool is_whole_number(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_BOOLEAN:
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
    case V4L2_CTRL_TYPE_BITMASK:
    case V4L2_CTRL_TYPE_INTEGER64: return true;
    default: return false;
  }
}

/// The control if the device has it and it is switched on.
std::optional<Control> find_control(const V4l2Device& device, std::uint32_t id) {
  v4l2_query_ext_ctrl query{};
  query.id = id;
  if (device.ioctl(VIDIOC_QUERY_EXT_CTRL, &query) < 0) return std::nullopt;
  if ((query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  return control_from(query);
}

int access(const V4l2Device& device, unsigned long request, const Control& control,
           std::int64_t& value) {
  v4l2_ext_control entry{};
  entry.id = control.id;
  const bool wide = control.type == V4L2_CTRL_TYPE_INTEGER64;
  if (wide) {
    entry.value64 = value;
  } else {
    entry.value = static_cast<std::int32_t>(value);
  }
  v4l2_ext_controls batch{};
  batch.which = V4L2_CTRL_WHICH_CUR_VAL;
  batch.count = 1;
  batch.controls = &entry;
  const int outcome = device.ioctl(request, &batch);
  if (outcome < 0) return outcome;
  if (wide) {
    value = entry.value64;
  } else if (control.type == V4L2_CTRL_TYPE_BITMASK) {
    value = static_cast<std::uint32_t>(entry.value);  // its topmost bit is no sign
  } else {
    value = entry.value;
  }
  return outcome;
}

std::string place(const V4l2Device& device, const Control& control) {
  return fmt::format("{}: control {}", device.node(), control.description.name);
}

/// Sets and reads back.
Result<LockedSetting> set_control(const V4l2Device& device, const Control& control,
                                  std::int64_t value) {
  if (control.description.read_only) {
    return fail(ErrorKind::bad_input, place(device, control), "can only be read",
                "leave this setting out");
  }
  std::int64_t sent = value;
  if (const int outcome = access(device, VIDIOC_S_EXT_CTRLS, control, sent); outcome < 0) {
    return tl::unexpected(
        v4l2_error(place(device, control), fmt::format("setting it to {}", value), -outcome));
  }
  std::int64_t in_force = 0;
  if (const int outcome = access(device, VIDIOC_G_EXT_CTRLS, control, in_force); outcome < 0) {
    return tl::unexpected(v4l2_error(place(device, control), "reading it back", -outcome));
  }
  return LockedSetting{control.description.name, value, in_force};
}

/// What the device must have; `setting` in the words of the configuration.
Result<Control> need_control(const V4l2Device& device, std::uint32_t id, std::string_view setting) {
  const std::optional<Control> control = find_control(device, id);
  if (!control) {
    return fail(ErrorKind::bad_input, device.node(),
                fmt::format("{} has no control for {}", device.model(), setting),
                fmt::format("leave {} out of the camera's settings", setting));
  }
  return *control;
}

Result<void> check_range(const V4l2Device& device, const Control& control, std::int64_t value,
                         std::string_view setting) {
  const CameraControl& range = control.description;
  if (value >= range.minimum && value <= range.maximum) return {};
  return fail(ErrorKind::bad_input, place(device, control),
              fmt::format("{} is outside what the camera can do ({} is not in {}..{})", setting,
                          value, range.minimum, range.maximum),
              "choose a value inside");
}

/// Switches an automatic off, if there is one, and makes sure that it stays off.
Result<void> switch_off(const V4l2Device& device, std::uint32_t id,
                        std::vector<LockedSetting>& locked) {
  const std::optional<Control> automatic = find_control(device, id);
  if (!automatic) return {};
  const Result<LockedSetting> set = set_control(device, *automatic, 0);
  if (!set) return forward(set);
  if (set->in_force != 0) {
    return fail(ErrorKind::hardware, place(device, *automatic), "could not be switched off",
                "use another camera");
  }
  locked.push_back(*set);
  return {};
}

bool has_menu_entry(const V4l2Device& device, const Control& menu, std::int64_t index) {
  if (index < menu.description.minimum || index > menu.description.maximum) return false;
  v4l2_querymenu entry{};
  entry.id = menu.id;
  entry.index = static_cast<std::uint32_t>(index);
  return device.ioctl(VIDIOC_QUERYMENU, &entry) >= 0;
}

/// Manual exposure; shutter priority will do where it is all there is: without a motorised iris,
/// it leaves nothing automatic.
Result<void> expose_by_hand(const V4l2Device& device, std::vector<LockedSetting>& locked) {
  const std::optional<Control> mode = find_control(device, V4L2_CID_EXPOSURE_AUTO);
  if (!mode) return {};
  for (const std::int64_t by_hand : {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY}) {
    if (!has_menu_entry(device, *mode, by_hand)) continue;
    const Result<LockedSetting> set = set_control(device, *mode, by_hand);
    if (!set) return forward(set);
    if (set->in_force != by_hand) {
      return fail(ErrorKind::hardware, place(device, *mode), "automatic exposure stays on",
                  "use another camera");
    }
    locked.push_back(*set);
    return {};
  }
  return fail(ErrorKind::hardware, place(device, *mode), "offers no manual exposure",
              "leave exposure out of the camera's settings or use another camera");
}

Result<void> set_checked(const V4l2Device& device, const Control& control, std::int64_t value,
                         std::string_view setting, std::vector<LockedSetting>& locked) {
  if (auto inside = check_range(device, control, value, setting); !inside) return inside;
  const Result<LockedSetting> set = set_control(device, control, value);
  if (!set) return forward(set);
  locked.push_back(*set);
  return {};
}

Result<void> lock_exposure(const V4l2Device& device, microseconds exposure,
                           std::vector<LockedSetting>& locked) {
  const auto control = need_control(device, V4L2_CID_EXPOSURE_ABSOLUTE, "exposure");
  if (!control) return forward(control);
  if (auto by_hand = expose_by_hand(device, locked); !by_hand) return by_hand;
  const std::int64_t units = (exposure.count() + kExposureUnitUs / 2) / kExposureUnitUs;
  return set_checked(device, *control, units, fmt::format("exposure {} us", exposure.count()),
                     locked);
}

Result<void> lock_gain(const V4l2Device& device, double gain,
                       std::optional<double> gain_steps_per_unit,
                       std::vector<LockedSetting>& locked) {
  const auto control = need_control(device, V4L2_CID_GAIN, "gain");
  if (!control) return forward(control);
  if (gain != 1.0 && !gain_steps_per_unit) {
    return fail(ErrorKind::bad_input, place(device, *control),
                fmt::format("V4L2 gives gain no unit, so gain {} means nothing to it", gain),
                "ask for gain 1 (the control's minimum) or set gain_steps_per_unit");
  }
  if (auto off = switch_off(device, V4L2_CID_AUTOGAIN, locked); !off) return off;
  const double steps = gain == 1.0 ? 0.0 : (gain - 1.0) * *gain_steps_per_unit;
  return set_checked(device, *control, control->description.minimum + std::llround(steps),
                     fmt::format("gain {}", gain), locked);
}

Result<void> lock_white_balance(const V4l2Device& device, int kelvin,
                                std::vector<LockedSetting>& locked) {
  const auto control = need_control(device, V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white_balance_k");
  if (!control) return forward(control);
  if (auto off = switch_off(device, V4L2_CID_AUTO_WHITE_BALANCE, locked); !off) return off;
  return set_checked(device, *control, kelvin, fmt::format("white balance {} K", kelvin), locked);
}

Result<void> lock_focus(const V4l2Device& device, double focus,
                        std::vector<LockedSetting>& locked) {
  const auto control = need_control(device, V4L2_CID_FOCUS_ABSOLUTE, "focus");
  if (!control) return forward(control);
  if (auto off = switch_off(device, V4L2_CID_FOCUS_AUTO, locked); !off) return off;
  const CameraControl& range = control->description;
  const double steps =
      focus * static_cast<double>(range.maximum - range.minimum) / static_cast<double>(range.step);
  return set_checked(device, *control, range.minimum + std::llround(steps) * range.step,
                     fmt::format("focus {}", focus), locked);
}

}  // namespace

std::string control_name(std::string_view device_name) {
  std::string name;
  for (const char letter : device_name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) != 0) {
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  if (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

Result<std::vector<CameraControl>> list_v4l2_controls(const V4l2Device& device) {
  std::vector<CameraControl> controls;
  v4l2_query_ext_ctrl query{};
  for (int count = 0; count < kMostControls; ++count) {
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    const int outcome = device.ioctl(VIDIOC_QUERY_EXT_CTRL, &query);
    if (outcome == -EINVAL || outcome == -ENOTTY) break;  // the end, or no controls at all
    if (outcome < 0) {
      return tl::unexpected(v4l2_error(device.node(), "listing its controls", -outcome));
    }
    const Control control = control_from(query);
    if (!is_whole_number(control.type) || (control.flags & V4L2_CTRL_FLAG_DISABLED) != 0) continue;
    CameraControl described = control.description;
    const int read = access(device, VIDIOC_G_EXT_CTRLS, control, described.value);
    if (read == -ENODEV) {
      return tl::unexpected(v4l2_error(device.node(), "reading its controls", ENODEV));
    }
    if (read >= 0) controls.push_back(std::move(described));
  }
  return controls;
}

Result<std::vector<LockedSetting>> lock_v4l2_controls(const V4l2Device& device,
                                                      const CameraSettings& settings,
                                                      std::optional<double> gain_steps_per_unit) {
  std::vector<LockedSetting> locked;
  Result<void> done;
  if (settings.exposure) done = lock_exposure(device, *settings.exposure, locked);
  if (done && settings.gain) done = lock_gain(device, *settings.gain, gain_steps_per_unit, locked);
  if (done && settings.white_balance_k) {
    done = lock_white_balance(device, *settings.white_balance_k, locked);
  }
  if (done && settings.focus) done = lock_focus(device, *settings.focus, locked);
  if (!done) return forward(done);
  return locked;
}

std::optional<microseconds> manual_exposure(const V4l2Device& device) {
  const auto exposure = find_control(device, V4L2_CID_EXPOSURE_ABSOLUTE);
  if (!exposure) return std::nullopt;
  if (const auto mode = find_control(device, V4L2_CID_EXPOSURE_AUTO)) {
    std::int64_t chosen = V4L2_EXPOSURE_AUTO;
    if (access(device, VIDIOC_G_EXT_CTRLS, *mode, chosen) < 0) return std::nullopt;
    if (chosen != V4L2_EXPOSURE_MANUAL && chosen != V4L2_EXPOSURE_SHUTTER_PRIORITY) {
      return std::nullopt;
    }
  }
  std::int64_t units = 0;
  if (access(device, VIDIOC_G_EXT_CTRLS, *exposure, units) < 0) return std::nullopt;
  return microseconds{units * kExposureUnitUs};
}

}  // namespace skullstation
