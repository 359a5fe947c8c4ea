#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/clock.h"
#include "core/random.h"
#include "firmware_io/turntable_config.h"

namespace skullstation {

/// What can be wrong between the motor and the specimen.
struct PlatterFaults {
  double slip_fraction = 0.0;
  std::optional<double> stall_at_deg;
  bool index_switch_missing = false;
};

/// The mechanics of a simulated turntable: a motor, a gear with play, a platter that rings after
/// each step that moved it, an index switch. Not thread-safe. Its angle 0 is where a perfect
/// homing ends: the switch is mounted so that its edge lies half a step before a step.
class SimulatedPlatter {
 public:
  SimulatedPlatter(const TurntableConfig& config, const PlatterFaults& faults, std::uint64_t seed);

  void step(int direction, Instant at);
  /// The current is gone: whoever leans on the platter turns it a little.
  void let_go(Instant at);

  bool index_closed() const;
  /// All the turning the motor was told to do so far, either way.
  double commanded_turn_deg() const { return commanded_turn_deg_; }
  /// Where the platter was at any moment, unwrapped. The last quarter of a million steps are
  /// remembered; before them it is said to have stood where they began.
  double angle_deg(Instant at) const;

 private:
  struct Rest {
    Instant since;
    double angle_deg;
    double swing;  // -1, 0 or +1: which way it was pushed
  };

  void turn_to(double angle_deg, double swing, Instant at);

  const TurntableConfig config_;
  const PlatterFaults faults_;
  Random random_;
  double motor_deg_;  // referred to the platter
  double commanded_turn_deg_ = 0.0;
  std::deque<Rest> rests_;  // never empty
};

}  // namespace skullstation
