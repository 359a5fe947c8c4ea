#include "capture/cameras/libcamera_controls.h"

#include <fmt/format.h>
#include <libcamera/control_ids.h>
#include <libcamera/version.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#if LIBCAMERA_VERSION_MAJOR == 0 && LIBCAMERA_VERSION_MINOR == 0 && LIBCAMERA_VERSION_PATCH < 3
#error "libcamera 0.0.3 or newer is needed: ControlList::get() returned bare values before"
#endif

namespace skullstation {
namespace {

namespace ids = libcamera::controls;
using libcamera::ControlInfoMap;
using libcamera::ControlList;
using libcamera::ControlValue;

constexpr double kMilli = 1000.0;

/// A scalar number as a whole one; real numbers in thousandths. Nothing for other types.
std::optional<std::int64_t> whole(const ControlValue& value) {
  if (value.isArray()) return std::nullopt;
  switch (value.type()) {
    case libcamera::ControlTypeBool: return value.get<bool>() ? 1 : 0;
    case libcamera::ControlTypeByte: return value.get<std::uint8_t>();
    case libcamera::ControlTypeInteger32: return value.get<std::int32_t>();
    case libcamera::ControlTypeInteger64: return value.get<std::int64_t>();
    case libcamera::ControlTypeFloat: return std::llround(kMilli * value.get<float>());
    default: return std::nullopt;
  }
}

std::string name_of(const libcamera::ControlId& id) {
  return snake_case(id.name()) + (id.type() == libcamera::ControlTypeFloat ? "_milli" : "");
}

/// Searched by hand: a map of no controls at all knows no ids either, and its find() crashes.
const libcamera::ControlInfo* find(const ControlInfoMap& available,
                                   const libcamera::ControlId& id) {
  for (const auto& [known, info] : available) {
    if (known->id() == id.id()) return &info;
  }
  return nullptr;
}

/// One setting: its control must be there and its value in range.
template <class T>
Result<void> add(ControlList& list, const ControlInfoMap& available,
                 const libcamera::Control<T>& id, T value, std::string_view setting,
                 const std::string& camera) {
  const libcamera::ControlInfo* info = find(available, id);
  if (info == nullptr) {
    return fail(ErrorKind::bad_input, camera,
                fmt::format("the camera has no control for {}", setting),
                fmt::format("leave {} out of the camera's settings", setting));
  }
  const ControlValue wanted(value);
  const auto asked = whole(wanted);
  const auto least = whole(info->min());
  const auto most = whole(info->max());
  // A maximum of 0 is how some pipelines say that they know no limit.
  const bool bounded = least && most && *most > *least;
  if (bounded && (*asked < *least || *asked > *most)) {
    return fail(ErrorKind::bad_input, fmt::format("{}: control {}", camera, name_of(id)),
                fmt::format("{} is outside what the camera can do ({} is not in {}..{})", setting,
                            *asked, *least, *most),
                "choose a value inside");
  }
  list.set(id.id(), wanted);
  return {};
}

/// Switches an automatic off if there is one.
template <class T>
void switch_off(ControlList& list, const ControlInfoMap& available, const libcamera::Control<T>& id,
                T off) {
  if (find(available, id) != nullptr) list.set(id.id(), ControlValue(off));
}

/// A frame can't be shorter than its exposure. Cameras that stream at a fixed rate would cut a
/// long exposure short; the margin is for the readout.
void make_room_for(ControlList& list, const ControlInfoMap& available,
                   std::chrono::microseconds exposure) {
  constexpr std::int64_t kUsualFrameUs = 33'333;
  constexpr std::int64_t kReadoutMarginUs = 2'000;
  const std::int64_t frame_us = exposure.count() + kReadoutMarginUs;
  if (frame_us <= kUsualFrameUs || find(available, ids::FrameDurationLimits) == nullptr) return;
  const std::array<std::int64_t, 2> limits{frame_us, frame_us};
  list.set(ids::FrameDurationLimits, libcamera::Span<const std::int64_t, 2>(limits));
}

}  // namespace

std::string snake_case(const std::string& camel_case) {
  std::string name;
  for (const char letter : camel_case) {
    if (std::isupper(static_cast<unsigned char>(letter)) != 0 && !name.empty()) name += '_';
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  }
  return name;
}

std::vector<CameraControl> list_controls(const ControlInfoMap& available,
                                         const ControlList& metadata) {
  std::vector<CameraControl> controls;
  for (const auto& [id, info] : available) {
    const auto least = whole(info.min());
    const auto most = whole(info.max());
    if (!least || !most) continue;
    CameraControl control;
    control.name = name_of(*id);
    control.minimum = *least;
    control.maximum = *most;
    control.default_value = whole(info.def()).value_or(*least);
    control.value = control.default_value;
    if (metadata.contains(id->id())) {
      control.value = whole(metadata.get(id->id())).value_or(control.default_value);
    }
    controls.push_back(std::move(control));
  }
  std::sort(controls.begin(), controls.end(),
            [](const CameraControl& a, const CameraControl& b) { return a.name < b.name; });
  return controls;
}

Result<ControlList> controls_for(const ControlInfoMap& available, const CameraSettings& settings,
                                 const std::string& camera) {
  ControlList list(ids::controls);
  Result<void> done;
  if (settings.exposure) {
    switch_off(list, available, ids::AeEnable, false);
    make_room_for(list, available, *settings.exposure);
    done = add(list, available, ids::ExposureTime,
               static_cast<std::int32_t>(settings.exposure->count()), "exposure", camera);
  }
  if (done && settings.gain) {
    switch_off(list, available, ids::AeEnable, false);
    done =
        add(list, available, ids::AnalogueGain, static_cast<float>(*settings.gain), "gain", camera);
  }
  if (done && settings.white_balance_k) {
    switch_off(list, available, ids::AwbEnable, false);
    done = add(list, available, ids::ColourTemperature, std::int32_t{*settings.white_balance_k},
               "white_balance_k", camera);
  }
  if (done && settings.focus) {
    switch_off(list, available, ids::AfMode, std::int32_t{ids::AfModeManual});
    // Dioptres: 0 is infinity, the maximum the nearest distance.
    const libcamera::ControlInfo* lens = find(available, ids::LensPosition);
    const bool known = lens != nullptr && lens->max().type() == libcamera::ControlTypeFloat;
    const float nearest = known ? lens->max().get<float>() : 0.0F;
    done = add(list, available, ids::LensPosition, static_cast<float>(*settings.focus) * nearest,
               "focus", camera);
  }
  if (!done) return forward(done);
  return list;
}

Result<std::vector<LockedSetting>> settings_in_force(const ControlList& asked,
                                                     const ControlList& metadata,
                                                     const std::string& camera) {
  std::vector<LockedSetting> locked;
  const std::array<const libcamera::ControlId*, 4> reported{
      &ids::ExposureTime, &ids::AnalogueGain, &ids::ColourTemperature, &ids::LensPosition};
  for (const libcamera::ControlId* id : reported) {
    if (!asked.contains(id->id())) continue;
    if (!metadata.contains(id->id())) {
      return fail(ErrorKind::hardware, fmt::format("{}: control {}", camera, name_of(*id)),
                  "the camera does not tell which value its pictures were made with",
                  "leave this setting out: it could not be vouched for");
    }
    locked.push_back({name_of(*id), whole(asked.get(id->id())).value_or(0),
                      whole(metadata.get(id->id())).value_or(0)});
  }
  return locked;
}

std::optional<std::chrono::microseconds> exposure_of(const ControlList& metadata) {
  const auto exposure = metadata.get(ids::ExposureTime);
  if (!exposure) return std::nullopt;
  return std::chrono::microseconds{*exposure};
}

std::optional<std::chrono::nanoseconds> sensor_timestamp_of(const ControlList& metadata) {
  const auto timestamp = metadata.get(ids::SensorTimestamp);
  if (!timestamp) return std::nullopt;
  return std::chrono::nanoseconds{*timestamp};
}

std::optional<std::chrono::nanoseconds> frame_duration_of(const ControlList& metadata) {
  const auto duration = metadata.get(ids::FrameDuration);
  if (!duration) return std::nullopt;
  return std::chrono::microseconds{*duration};
}

}  // namespace skullstation
