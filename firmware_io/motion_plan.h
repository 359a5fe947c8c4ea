#pragma once

#include <chrono>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Limits of the turntable's motion, all referred to the platter, not to the motor.
struct MotionLimits {
  double steps_per_turn = 6400.0;  ///< microsteps for one turn of the platter, gears included
  double max_speed_deg_s = 30.0;
  double max_acceleration_deg_s2 = 60.0;
  double max_jerk_deg_s3 = 240.0;  ///< S-curve; a tall skull must not rock

  Result<void> validate() const;
};

/// A motion as pure data: each step is due `due[i]` after the start (strictly increasing,
/// first > 0); the platter rests before the first and after the last step.
struct MotionPlan {
  int direction = 1;  ///< +1 counter-clockwise seen from above
  std::vector<std::chrono::nanoseconds> due;

  std::chrono::nanoseconds duration() const {
    return due.empty() ? std::chrono::nanoseconds{0} : due.back();
  }
};

/// Rest to rest over `steps` (sign is the direction) in the least time within the limits: a
/// symmetric S-curve with up to seven phases (Biagiotti & Melchiorri 2008, section 3.4).
MotionPlan plan_motion(long steps, const MotionLimits& limits);

}  // namespace skullstation
