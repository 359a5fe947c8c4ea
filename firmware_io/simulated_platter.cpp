#include "firmware_io/simulated_platter.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/units.h"

namespace skullstation {

namespace {

constexpr double index_flag_deg = 6.0;    // the switch is closed over this much of a turn
constexpr double play_of_backlash = 0.6;  // the gear is a little better than configured
constexpr double leaning_deg = 1.0;       // how far a free platter is turned at most
constexpr double swing_amplitude_deg = 0.05;
constexpr double swing_frequency_hz = 8.0;
constexpr double swing_decay_s = 0.06;
constexpr std::size_t remembered_steps = 1 << 18;

double play_deg(const TurntableConfig& config) { return play_of_backlash * config.backlash_deg; }

/// Damped oscillation about the angle at which a push ended, `seconds` after it.
double swing_deg(double seconds) {
  return swing_amplitude_deg * std::exp(-seconds / swing_decay_s) *
         std::sin(2.0 * std::numbers::pi * swing_frequency_hz * seconds);
}

}  // namespace

SimulatedPlatter::SimulatedPlatter(const TurntableConfig& config, const PlatterFaults& faults,
                                   std::uint64_t seed)
    : config_(config), faults_(faults), random_(seed) {
  const double step_deg = config.limits.step_deg();
  const double angle_deg = std::floor(random_.uniform() * config.limits.steps_per_turn) * step_deg;
  motor_deg_ = angle_deg + play_deg(config);
  rests_.push_back({Instant::min(), angle_deg, 0.0});
}

void SimulatedPlatter::step(int direction, Instant at) {
  const double step_deg = config_.limits.step_deg();
  commanded_turn_deg_ += step_deg;
  if (faults_.stall_at_deg && commanded_turn_deg_ > *faults_.stall_at_deg) return;
  motor_deg_ += direction * step_deg * (1.0 - faults_.slip_fraction);
  // The motor drags the platter along at either end of the gear's play.
  const double before_deg = rests_.back().angle_deg;
  const double after_deg = std::clamp(before_deg, motor_deg_ - play_deg(config_), motor_deg_);
  if (after_deg != before_deg) turn_to(after_deg, direction, at);
}

void SimulatedPlatter::let_go(Instant at) {
  if (config_.holds_without_current) return;
  const double step_deg = config_.limits.step_deg();
  // Afterwards the rotor falls into a pole again: whole steps.
  const double turned_deg =
      std::round(random_.uniform(-leaning_deg, leaning_deg) / step_deg) * step_deg;
  motor_deg_ += turned_deg;
  turn_to(rests_.back().angle_deg + turned_deg, 0.0, at);
}

bool SimulatedPlatter::index_closed() const {
  if (faults_.index_switch_missing) return false;
  const double edge_deg = -config_.home_offset_deg - 0.5 * config_.limits.step_deg();
  return wrapped_deg(rests_.back().angle_deg - edge_deg) < index_flag_deg;
}

double SimulatedPlatter::angle_deg(Instant at) const {
  const auto next = std::upper_bound(rests_.begin(), rests_.end(), at,
                                     [](Instant t, const Rest& rest) { return t < rest.since; });
  if (next == rests_.begin()) return rests_.front().angle_deg;
  const Rest& rest = *std::prev(next);
  if (rest.swing == 0.0) return rest.angle_deg;
  return rest.angle_deg +
         rest.swing * swing_deg(std::chrono::duration<double>(at - rest.since).count());
}

void SimulatedPlatter::turn_to(double angle_deg, double swing, Instant at) {
  rests_.push_back({at, angle_deg, swing});
  if (rests_.size() > remembered_steps) rests_.pop_front();
}

}  // namespace skullstation
