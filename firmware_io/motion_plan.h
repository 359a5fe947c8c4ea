#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Limits of the turntable's motion, all referred to the platter, not to the motor.
struct MotionLimits {
  double steps_per_turn = 6400.0;  ///< microsteps for one turn of the platter, gears included
  double max_speed_deg_s = 30.0;
  double max_acceleration_deg_s2 = 60.0;
  double max_jerk_deg_s3 = 240.0;  ///< S-curve; a tall skull must not rock

  double step_deg() const { return 360.0 / steps_per_turn; }

  /// Each limit is a positive number and the step rate at full speed is one that a CPU can make.
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
/// symmetric S-curve with up to seven phases (Biagiotti & Melchiorri 2008, section 3.4). A step is
/// due when the curve crosses the middle between two of the motor's positions.
/// \pre limits.validate() holds.
MotionPlan plan_motion(long steps, const MotionLimits& limits);

/// The same motion, told to stop when `done` of its steps were made: equal to `plan` up to there,
/// then to rest in the least time within the limits, so that no step is lost.
/// \pre `plan` is plan_motion(n, limits) for some n; done <= plan.due.size().
MotionPlan braked(const MotionPlan& plan, std::size_t done, const MotionLimits& limits);

}  // namespace skullstation
