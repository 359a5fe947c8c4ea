#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/clock.h"
#include "firmware_io/station_hardware.h"
#include "firmware_io/turntable_config.h"

namespace skullstation {

/// What can go wrong with a simulated station, switched on one by one.
struct SimulatedFaults {
  double slip_fraction = 0.0;                  ///< of every commanded turn, lost (0.02 = 2 %)
  std::optional<double> stall_at_deg;          ///< total turn [deg], homing's included, after which
                                               ///< the platter sticks
  bool index_switch_missing = false;           ///< homing never sees its switch
  bool button_bounces = false;                 ///< each edge of the button comes as a burst
  std::optional<double> estop_after_turn_deg;  ///< total turn [deg], homing's included, at which
                                               ///< someone hits the stop
  bool estop_stuck = false;                    ///< reset() finds the button still pressed
};

/// The station without its hardware: a product part, used by the demo, by `--simulate` and by the
/// tests. Times come from the given clock: with a SimulatedClock a scan takes no time at all,
/// with a SystemClock it moves as a real one does.
class SimulatedStation {
 public:
  /// \pre config.validate() holds.
  SimulatedStation(const TurntableConfig& config, const SimulatedFaults& faults, Clock& clock,
                   std::uint64_t seed);
  ~SimulatedStation();
  SimulatedStation(const SimulatedStation&) = delete;
  SimulatedStation& operator=(const SimulatedStation&) = delete;

  /// The parts, for the program under test. They share this object's world, which must outlive
  /// them.
  StationHardware hardware();

  /// The truth: where the platter really is at any moment so far (slip, backlash and the
  /// vibration after each stop included), unwrapped [deg], from where a perfect homing ends. The
  /// last quarter of a million steps are remembered. Safe from any thread.
  double true_table_angle_deg(Instant at) const;

  /// What a hand does at the station. From 1.5 s on a press is Press::held.
  void press_button(std::chrono::milliseconds held);
  void press_estop();
  void release_estop();

  /// What an eye sees there.
  Signal shown_signal() const;
  bool lights_on() const;
  bool motor_current_on() const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace skullstation
