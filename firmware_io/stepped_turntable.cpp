#include "firmware_io/stepped_turntable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr auto current_rise_time = 50ms;  // the driver wakes, the rotor falls into its pole
constexpr auto tolerated_lateness = 1ms;
constexpr double index_hysteresis_deg = 2.0;  // more than any switch has
constexpr double slow_homing = 0.125;         // of the homing speed, for the second approach

tl::unexpected<Error> turntable_error(std::string what, std::string advice = {}) {
  return fail(ErrorKind::hardware, "turntable", std::move(what), std::move(advice));
}

tl::unexpected<Error> cancelled() {
  return fail(ErrorKind::cancelled, "turntable", "stopped on request");
}

}  // namespace

SteppedTurntable::SteppedTurntable(std::unique_ptr<StepDriver> driver,
                                   std::shared_ptr<const TripLatch> interlock,
                                   const TurntableConfig& config, Clock& clock)
    : driver_(std::move(driver)), interlock_(std::move(interlock)), config_(config), clock_(clock) {
  slack_ = steps_in(config_.backlash_deg);
}

SteppedTurntable::~SteppedTurntable() { switch_current_off(); }

Result<void> SteppedTurntable::home(std::stop_token stop) {
  const std::lock_guard lock(moving_);
  homed_ = false;
  auto done = switch_current_on();
  if (done) done = find_zero(stop);
  if (done) done = approach(0, stop);
  homed_ = done.has_value();
  if (!done) switch_current_off();
  return done;
}

Result<void> SteppedTurntable::move_to(double angle_deg, std::stop_token stop) {
  const std::lock_guard lock(moving_);
  if (!std::isfinite(angle_deg)) {
    return fail(ErrorKind::bad_input, "turntable", fmt::format("can't turn to {} deg", angle_deg));
  }
  if (interlock_->tripped()) return stopped_by_interlock();
  if (!this->angle_deg()) {
    return turntable_error("its position is unknown", "home it before it is moved");
  }
  if (auto on = switch_current_on(); !on) return on;
  // The position counts on over whole turns: the nearest of them, and the absolute angle rounded.
  const double step_deg = config_.limits.step_deg();
  const double turns =
      std::floor((static_cast<double>(position_) * step_deg - angle_deg) / 360.0 + 0.5);
  return approach(std::lround((angle_deg + 360.0 * turns) / step_deg), stop);
}

Result<void> SteppedTurntable::release() {
  const std::lock_guard lock(moving_);
  if (!config_.holds_without_current) homed_ = false;
  current_on_ = false;
  return driver_->set_current(false);
}

std::optional<double> SteppedTurntable::angle_deg() const {
  const bool current_was_lost = interlock_intervened() && !config_.holds_without_current;
  if (!homed_ || current_was_lost) return std::nullopt;
  const double turn = config_.limits.steps_per_turn;
  double steps = std::fmod(static_cast<double>(position_), turn);
  if (steps < 0.0) steps += turn;
  return steps * config_.limits.step_deg();
}

SteppingDiagnostics SteppedTurntable::diagnostics() const {
  const std::lock_guard lock(diagnostics_mutex_);
  return diagnostics_;
}

/// Finds the switch's edge fast, backs off, finds the same edge again slowly and counter-clockwise,
/// as every later approach will be.
Result<void> SteppedTurntable::find_zero(const std::stop_token& stop) {
  const double speed_deg_s = config_.home_speed_deg_s;
  const long search = steps_in(config_.home_search_deg);
  const long clearance = steps_in(config_.backlash_deg + index_hysteresis_deg);

  const auto closed = seek_index(true, search, speed_deg_s, stop);
  if (!closed) return forward(closed);
  if (!*closed) {
    return turntable_error(
        fmt::format("index switch never seen in {} deg", config_.home_search_deg),
        "check the switch, its cable and that the platter turns with the motor");
  }
  // Back to where it closed: a narrow flag may have been passed while slowing down.
  if (auto back = turn_by(**closed - position_, stop); !back) return back;
  const auto open = seek_index(false, -search, speed_deg_s, stop);
  if (!open) return forward(open);
  if (!*open) {
    return turntable_error(
        fmt::format("index switch stays closed over {} deg", config_.home_search_deg),
        "check the switch, its cable and whether it is set as active low");
  }
  if (auto back = turn_by(**open - clearance - position_, stop); !back) return back;
  const auto edge = seek_index(true, 4 * clearance, slow_homing * speed_deg_s, stop);
  if (!edge) return forward(edge);
  if (!*edge) {
    return turntable_error("index switch seen once, but not again on the slow approach",
                           "check that the switch sits firmly and backlash_deg is large enough");
  }
  position_ -= **edge + std::lround(config_.home_offset_deg / config_.limits.step_deg());
  return {};
}

/// Ends at `position` counter-clockwise, with the gear's play taken up.
Result<void> SteppedTurntable::approach(long position, const std::stop_token& stop) {
  if (position - position_ < slack_) {
    const long before = position - steps_in(config_.backlash_deg);
    if (auto turned = turn_by(before - position_, stop); !turned) return turned;
  }
  return turn_by(position - position_, stop);
}

Result<void> SteppedTurntable::turn_by(long steps, const std::stop_token& stop) {
  const auto turned = travel({steps, config_.limits, std::nullopt}, stop);
  if (!turned) return forward(turned);
  return {};
}

Result<SteppedTurntable::Sighting> SteppedTurntable::seek_index(bool closed, long steps,
                                                                double speed_deg_s,
                                                                const std::stop_token& stop) {
  const auto now_closed = driver_->index_closed();
  if (!now_closed) return forward(now_closed);
  if (*now_closed == closed) return position_.load();
  MotionLimits limits = config_.limits;
  limits.max_speed_deg_s = std::min(limits.max_speed_deg_s, speed_deg_s);
  return travel({steps, limits, closed}, stop);
}

Result<SteppedTurntable::Sighting> SteppedTurntable::travel(const Travel& travel,
                                                            const std::stop_token& stop) {
  if (stop.stop_requested()) return cancelled();
  if (travel.steps == 0) return Sighting{};
  MotionPlan plan = plan_motion(travel.steps, travel.limits);
  Result<Sighting> outcome;
  std::jthread stepping([&] {
    const auto prepared = driver_->prepare_thread();
    {
      const std::lock_guard lock(diagnostics_mutex_);
      diagnostics_.not_real_time = prepared ? "" : prepared.error().message();
    }
    outcome = make_steps(travel, std::move(plan), stop);
  });
  stepping.join();
  if (!outcome && outcome.error().kind != ErrorKind::cancelled) {
    homed_ = false;  // steps may be lost
    switch_current_off();
  }
  return outcome;
}

Result<SteppedTurntable::Sighting> SteppedTurntable::make_steps(const Travel& travel,
                                                                MotionPlan plan,
                                                                const std::stop_token& stop) {
  if (auto set = driver_->set_direction(plan.direction); !set) return forward(set);
  Sighting sighting;
  bool braking = false;
  Instant start = clock_.now();
  for (std::size_t done = 0; done < plan.due.size();) {
    const Instant due = start + plan.due[done];
    driver_->wait_until(due);
    if (interlock_intervened()) return stopped_by_interlock();
    if (!braking && (sighting || stop.stop_requested())) {
      plan = braked(plan, done, travel.limits);
      braking = true;
      continue;
    }
    const std::chrono::nanoseconds lateness = clock_.now() - due;
    start += lateness;
    if (auto stepped = driver_->step(); !stepped) return forward(stepped);
    step_was_made(plan.direction, lateness);
    ++done;
    if (travel.until_index && !sighting) {
      const auto closed = driver_->index_closed();
      if (!closed) return forward(closed);
      if (*closed == *travel.until_index) sighting = position_;
    }
  }
  if (stop.stop_requested() && braking) return cancelled();
  return sighting;
}

Result<void> SteppedTurntable::switch_current_on() {
  if (interlock_intervened()) current_on_ = false;
  trips_seen_ = interlock_->trips();
  if (interlock_->tripped()) return stopped_by_interlock();
  if (current_on_) return {};
  if (auto on = driver_->set_current(true); !on) return on;
  current_on_ = true;
  driver_->wait_until(clock_.now() + current_rise_time);
  if (interlock_intervened()) {  // perhaps just before the current came on
    switch_current_off();
    return stopped_by_interlock();
  }
  return {};
}

/// Where an error is on its way already; a motor driver that can't be reached has told so by then.
void SteppedTurntable::switch_current_off() {
  current_on_ = false;
  static_cast<void>(driver_->set_current(false));
}

tl::unexpected<Error> SteppedTurntable::stopped_by_interlock() const {
  const std::string reason = interlock_->reason();
  return turntable_error(reason.empty() ? "stopped by the interlock" : reason,
                         "make the station safe, reset the interlock, then home the turntable");
}

void SteppedTurntable::step_was_made(int direction, std::chrono::nanoseconds lateness) {
  position_ += direction;
  slack_ = direction < 0 ? steps_in(config_.backlash_deg) : std::max(0L, slack_ - 1);
  const std::lock_guard lock(diagnostics_mutex_);
  ++diagnostics_.steps;
  if (lateness > tolerated_lateness) ++diagnostics_.late_steps;
  diagnostics_.max_lateness = std::max(diagnostics_.max_lateness, lateness);
}

long SteppedTurntable::steps_in(double angle_deg) const {
  return std::lround(std::ceil(angle_deg / config_.limits.step_deg()));
}

}  // namespace skullstation
