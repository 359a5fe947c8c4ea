#pragma once

#include "core/clock.h"
#include "core/result.h"

namespace skullstation {

/// What a step motor's driver has: the wires that SteppedTurntable pulls. Directions are those of
/// the platter: +1 is counter-clockwise seen from above.
class StepDriver {
 public:
  virtual ~StepDriver() = default;

  virtual Result<void> set_current(bool on) = 0;
  virtual Result<void> set_direction(int direction) = 0;
  /// One pulse, one step.
  virtual Result<void> step() = 0;
  /// Whether the index switch is closed.
  virtual Result<bool> index_closed() = 0;

  /// Called first on each thread that is going to step. A failure is worth reporting; it is no
  /// reason not to step.
  virtual Result<void> prepare_thread() = 0;
  /// Sleeps to the absolute deadline, or returns at once if it has passed.
  virtual void wait_until(Instant deadline) = 0;
};

}  // namespace skullstation
