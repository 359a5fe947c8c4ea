#pragma once

#include <optional>
#include <stop_token>

#include "core/result.h"

namespace skullstation {

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

  /// Where the platter was last commanded to, if that is known.
  virtual std::optional<double> angle_deg() const = 0;
};

}  // namespace skullstation
