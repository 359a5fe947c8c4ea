#pragma once

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/hardware_lab/gpio_sim.h"

namespace skullstation {

/// Turntable, index switch, button and emergency stop at the wires of a station that runs in
/// another process: what it does to its lines is learnt from the kernel's events. The platter must
/// not make more than some fifty steps a second, or the index switch answers too late.
class WiredTable {
 public:
  WiredTable(GpioSim& chip, double steps_per_turn);

  /// Whichever way, with the current on.
  long steps_made() const { return steps_made_; }
  bool current_on() const { return !chip_.level("turntable-enable"); }

  void press_button(std::chrono::milliseconds held = std::chrono::milliseconds(400));
  void press_stop() { chip_.pull("estop", true); }
  void release_stop() { chip_.pull("estop", false); }

  bool green() const { return chip_.level("lamp-green"); }
  bool yellow() const { return chip_.level("lamp-yellow"); }
  bool red() const { return chip_.level("lamp-red"); }

 private:
  void follow(const std::stop_token& stop);

  GpioSim& chip_;
  const double step_deg_;
  std::atomic<long> steps_made_{0};
  std::jthread motor_;  // last: it uses everything above
};

}  // namespace skullstation
