#include "firmware_io/motion_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>

namespace skullstation {

namespace {

constexpr double max_step_rate_hz = 100'000.0;

/// A stretch of constant jerk. Positions are in steps, times in seconds.
struct Phase {
  double length;
  double position, speed, acceleration, jerk;  ///< at its begin; the jerk throughout

  double position_at(double t) const {
    return position + t * (speed + t * (acceleration / 2.0 + t * jerk / 6.0));
  }
  double speed_at(double t) const { return speed + t * (acceleration + t * jerk / 2.0); }
  double acceleration_at(double t) const { return acceleration + t * jerk; }
};

/// A motion that never turns back, phase after phase.
class Profile {
 public:
  Profile() = default;
  Profile(double position, double speed, double acceleration)
      : position_(position), speed_(speed), acceleration_(acceleration) {}

  void append(double length, double jerk) {
    if (length <= 0.0) return;
    const Phase phase{length, position_, speed_, acceleration_, jerk};
    phases_.push_back(phase);
    position_ = phase.position_at(length);
    speed_ = phase.speed_at(length);
    acceleration_ = phase.acceleration_at(length);
  }

  const std::vector<Phase>& phases() const { return phases_; }
  double end_position() const { return position_; }

  /// When the motion crosses `position`: Newton's iteration kept inside a shrinking bracket.
  double time_at(double position) const {
    double begin = 0.0;
    auto phase = phases_.begin();
    while (std::next(phase) != phases_.end() && std::next(phase)->position <= position) {
      begin += phase->length;
      ++phase;
    }
    double low = 0.0;
    double high = phase->length;
    double t = 0.5 * high;
    for (int i = 0; i < 100; ++i) {
      const double error = phase->position_at(t) - position;
      (error > 0.0 ? high : low) = t;
      const double newton = t - error / phase->speed_at(t);
      const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
      if (std::abs(next - t) <= 1e-11) break;  // a hundredth of a nanosecond
      t = next;
    }
    return begin + t;
  }

 private:
  std::vector<Phase> phases_;
  double position_ = 0.0, speed_ = 0.0, acceleration_ = 0.0;
};

/// The limits in steps and seconds.
struct StepLimits {
  double speed, acceleration, jerk;

  explicit StepLimits(const MotionLimits& limits)
      : speed(limits.max_speed_deg_s / limits.step_deg()),
        acceleration(limits.max_acceleration_deg_s2 / limits.step_deg()),
        jerk(limits.max_jerk_deg_s3 / limits.step_deg()) {}
};

/// The speed-up and, mirrored, the slow-down of a rest-to-rest motion.
struct Ramp {
  double jerk_time;  ///< at either end of the ramp
  double hold_time;  ///< at full acceleration, between them
};

/// The quickest ramp from rest to `speed`.
Ramp ramp_to(double speed, const StepLimits& limits) {
  if (speed * limits.jerk < limits.acceleration * limits.acceleration) {
    return {std::sqrt(speed / limits.jerk), 0.0};
  }
  const double jerk_time = limits.acceleration / limits.jerk;
  return {jerk_time, speed / limits.acceleration - jerk_time};
}

/// Biagiotti & Melchiorri 2008, section 3.4.3 (no speed at either end).
Profile rest_to_rest(double distance, const StepLimits& limits) {
  Ramp ramp = ramp_to(limits.speed, limits);
  double cruise_time = distance / limits.speed - (2.0 * ramp.jerk_time + ramp.hold_time);
  if (cruise_time < 0.0) {  // full speed is never reached
    cruise_time = 0.0;
    const double jerk_time = limits.acceleration / limits.jerk;
    const double ramp_time =
        0.5 * (jerk_time + std::sqrt(jerk_time * jerk_time + 4.0 * distance / limits.acceleration));
    ramp = ramp_time < 2.0 * jerk_time  // nor full acceleration
               ? Ramp{std::cbrt(0.5 * distance / limits.jerk), 0.0}
               : Ramp{jerk_time, ramp_time - 2.0 * jerk_time};
  }
  Profile profile;
  profile.append(ramp.jerk_time, limits.jerk);
  profile.append(ramp.hold_time, 0.0);
  profile.append(ramp.jerk_time, -limits.jerk);
  profile.append(cruise_time, 0.0);
  profile.append(ramp.jerk_time, -limits.jerk);
  profile.append(ramp.hold_time, 0.0);
  profile.append(ramp.jerk_time, limits.jerk);
  return profile;
}

/// From a moment of speeding up or cruising to rest: the acceleration falls straight through zero
/// to where a slow-down from the highest speed has it.
Profile brake(double position, double speed, double acceleration, const StepLimits& limits) {
  const double fade_time = acceleration / limits.jerk;
  const Ramp ramp = ramp_to(speed + 0.5 * acceleration * fade_time, limits);
  Profile profile(position, speed, acceleration);
  profile.append(fade_time + ramp.jerk_time, -limits.jerk);
  profile.append(ramp.hold_time, 0.0);
  profile.append(ramp.jerk_time, limits.jerk);
  return profile;
}

/// Step i moves the motor from position i to i + 1.
double crossing(std::size_t step) { return static_cast<double>(step) + 0.5; }

std::chrono::nanoseconds from_seconds(double seconds) {
  return std::chrono::nanoseconds{std::llround(seconds * 1e9)};
}

Result<void> expect_positive(const char* name, double value) {
  if (value > 0.0 && std::isfinite(value)) return {};
  return fail(ErrorKind::bad_input, name,
              fmt::format("is {}; a number above 0 was expected", value));
}

}  // namespace

Result<void> MotionLimits::validate() const {
  if (auto ok = expect_positive("steps_per_turn", steps_per_turn); !ok) return ok;
  if (auto ok = expect_positive("max_speed_deg_s", max_speed_deg_s); !ok) return ok;
  if (auto ok = expect_positive("max_acceleration_deg_s2", max_acceleration_deg_s2); !ok) return ok;
  if (auto ok = expect_positive("max_jerk_deg_s3", max_jerk_deg_s3); !ok) return ok;
  const double rate_hz = max_speed_deg_s / step_deg();
  if (rate_hz > max_step_rate_hz) {
    return fail(ErrorKind::bad_input, "max_speed_deg_s",
                fmt::format("{} deg/s at {} steps per turn is {:.0f} steps/s; at most {:.0f} are "
                            "possible",
                            max_speed_deg_s, steps_per_turn, rate_hz, max_step_rate_hz),
                "turn more slowly or choose larger microsteps");
  }
  return {};
}

MotionPlan plan_motion(long steps, const MotionLimits& limits) {
  MotionPlan plan;
  plan.direction = steps < 0 ? -1 : 1;
  if (steps == 0) return plan;
  const auto count = static_cast<std::size_t>(std::labs(steps));
  const Profile profile = rest_to_rest(static_cast<double>(count), StepLimits(limits));
  plan.due.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    plan.due.push_back(from_seconds(profile.time_at(crossing(i))));
  }
  return plan;
}

MotionPlan braked(const MotionPlan& plan, std::size_t done, const MotionLimits& limits) {
  MotionPlan stopped{plan.direction,
                     {plan.due.begin(), plan.due.begin() + static_cast<long>(done)}};
  if (done == 0) return stopped;  // still at rest
  const StepLimits step_limits(limits);
  const Profile profile = rest_to_rest(static_cast<double>(plan.due.size()), step_limits);
  const double told_at = profile.time_at(crossing(done - 1));
  double into_phase = told_at;
  auto phase = profile.phases().begin();
  while (std::next(phase) != profile.phases().end() && into_phase > phase->length) {
    into_phase -= phase->length;
    ++phase;
  }
  const double acceleration = phase->acceleration_at(into_phase);
  const double rounding = 1e-9 * step_limits.acceleration;
  if (acceleration < -rounding) return plan;  // slowing down: its own end is the quickest stop
  const Profile stop = brake(crossing(done - 1), phase->speed_at(into_phase),
                             std::max(0.0, acceleration), step_limits);
  for (std::size_t i = done; crossing(i) < stop.end_position(); ++i) {
    stopped.due.push_back(from_seconds(told_at + stop.time_at(crossing(i))));
  }
  return stopped;
}

}  // namespace skullstation
