#pragma once

#include <chrono>
#include <optional>
#include <stop_token>
#include <string>

#include "core/result.h"

namespace skullstation {

/// How punctually steps were made since the station was opened: what `doctor` shows.
struct SteppingDiagnostics {
  long steps = 0;
  long late_steps = 0;  ///< more than 1 ms late; each shifted the rest of its motion
  std::chrono::nanoseconds max_lateness{0};
  std::string
      not_real_time;  ///< why the stepping thread has no real-time priority; empty if it has
};

/// A turntable with one axis. Angles are degrees counter-clockwise seen from above, in [0, 360);
/// 0 is where homing ends. Calls block until the platter stands still (vibration apart: settling
/// is the capture loop's business). At every error and on a stop request the platter is at rest;
/// the position stays known only where no step can have been lost.
class Turntable {
 public:
  virtual ~Turntable() = default;

  /// Finds the index switch and sets the zero. Needed once after power-up and after any fault.
  virtual Result<void> home(std::stop_token stop) = 0;

  /// Turns to `angle_deg` the short way round, the last stretch always counter-clockwise, so that
  /// the gear's backlash lies on the same side at every view. Fails if not homed.
  virtual Result<void> move_to(double angle_deg, std::stop_token stop) = 0;

  /// Switches the motor's current off. The position is unknown afterwards unless the gear holds
  /// it (see TurntableConfig::holds_without_current).
  virtual Result<void> release() = 0;

  /// Where the platter was last commanded to, in whole steps (so it may differ from what was
  /// asked by half a step), if that is known. Safe from any thread.
  virtual std::optional<double> angle_deg() const = 0;

  virtual SteppingDiagnostics diagnostics() const { return {}; }
};

}  // namespace skullstation
