#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <semaphore>
#include <string>

#include "firmware_io/signal_player.h"
#include "firmware_io/station_hardware.h"
#include "firmware_io/turntable_config.h"

namespace skullstation::contract {

/// Quick, so that a suite in real time takes seconds, and coarse, so that an emulated machine
/// keeps up.
inline TurntableConfig quick_turntable() {
  TurntableConfig config;
  config.limits = {.steps_per_turn = 400,
                   .max_speed_deg_s = 360,
                   .max_acceleration_deg_s2 = 3000,
                   .max_jerk_deg_s3 = 60'000};
  config.backlash_deg = 3.6;
  config.home_speed_deg_s = 360;
  return config;
}

/// The same motions in a fraction of the time, for hardware that only exists in this process.
inline TurntableConfig hurried(TurntableConfig config) {
  const double factor = 4.0;
  config.limits.max_speed_deg_s *= factor;
  config.limits.max_acceleration_deg_s2 *= factor * factor;
  config.limits.max_jerk_deg_s3 *= factor * factor * factor;
  config.home_speed_deg_s *= factor;
  return config;
}

/// The hardware under test together with the world around it: the hand at the button and the eye
/// on the platter. Abilities that a world has not are told by an empty optional or by false; the
/// tests that need them are skipped.
class HardwareWorld {
 public:
  virtual ~HardwareWorld() = default;

  virtual StationHardware& hardware() = 0;
  virtual const TurntableConfig& turntable() const = 0;

  // A hand. A press may go on after the call.
  virtual void press_estop() = 0;
  virtual void release_estop() = 0;
  virtual void press_button(std::chrono::milliseconds held) = 0;
  virtual bool open_door() { return false; }
  virtual bool close_door() { return false; }
  /// Pulls the plug on the inputs and outputs for good.
  virtual bool unplug() { return false; }

  // An eye.
  virtual bool current_on() = 0;
  virtual bool lights_on() = 0;
  virtual PanelState panel() = 0;
  /// How far the platter (or, where there is none, the motor) stands counter-clockwise of some
  /// fixed mark, over all its turns; its vibration left out.
  virtual std::optional<double> turned_deg() { return std::nullopt; }
  /// An index switch follows the platter.
  virtual bool can_home() { return false; }
};

struct WorldOptions {
  TurntableConfig turntable = quick_turntable();
  bool button_bounces = false;
};

/// One kind of hardware, as a parameter of the suites.
struct HardwareKind {
  std::string name;
  std::function<std::unique_ptr<HardwareWorld>(const WorldOptions&)> make;
};

inline void PrintTo(const HardwareKind& kind, std::ostream* out) { *out << kind.name; }

inline std::string name_of(const testing::TestParamInfo<HardwareKind>& info) {
  return info.param.name;
}

/// Long enough for an emulated machine; a sound one needs none of it.
inline constexpr std::chrono::seconds patience{20};

/// Counts calls of a callback and waits for them.
class Bell {
 public:
  std::function<void()> rope() {
    return [this] { rung_.release(); };
  }
  bool heard() { return rung_.try_acquire_for(patience); }
  bool silent() { return !rung_.try_acquire(); }

 private:
  std::counting_semaphore<> rung_{0};
};

class HardwareContract : public testing::TestWithParam<HardwareKind> {
 protected:
  void make(const WorldOptions& options = {}) { world_ = GetParam().make(options); }

  HardwareWorld& world() {
    if (!world_) make();
    return *world_;
  }
  Turntable& table() { return *world().hardware().turntable; }
  Interlock& interlock() { return *world().hardware().interlock; }
  Button& button() { return *world().hardware().button; }

  /// Presses the stop and waits until the software learned of it.
  void press_estop() {
    Bell tripped;
    interlock().on_trip(tripped.rope());
    world().press_estop();
    EXPECT_TRUE(tripped.heard());
    interlock().on_trip({});
  }

 private:
  std::unique_ptr<HardwareWorld> world_;
};

}  // namespace skullstation::contract
