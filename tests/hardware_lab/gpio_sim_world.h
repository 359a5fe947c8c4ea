#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "core/clock.h"
#include "firmware_io/gpio_station.h"
#include "tests/contract/hardware_world.h"
#include "tests/hardware_lab/gpio_sim.h"

namespace skullstation {

/// The station's default line names, plus a door. Without the biases that a real wiring asks for:
/// gpio-sim has one pull per line, so that the software's would overrule the contact's.
GpioStationConfig gpio_sim_wiring();

/// A chip with these lines, every contact and every pull-up of the driver board at rest.
std::unique_ptr<GpioSim> make_gpio_sim_station(const std::string& name = "station");

/// The GPIO station on a chip of the kernel, with a motor, its index switch and a hand at the
/// other end of the wires.
class GpioSimWorld final : public contract::HardwareWorld {
 public:
  explicit GpioSimWorld(const contract::WorldOptions& options);
  ~GpioSimWorld() override;

  GpioSim& chip() { return *chip_; }
  /// Steps that the motor made since the start, whichever way.
  long steps_made() const { return steps_made_; }
  /// Returns when the motor made this many steps in all.
  void wait_for_steps(long steps_made);

  StationHardware& hardware() override { return hardware_; }
  const TurntableConfig& turntable() const override { return turntable_; }

  void press_estop() override { chip_->pull("estop", true); }
  void release_estop() override { chip_->pull("estop", false); }
  bool open_door() override;
  bool close_door() override;
  void press_button(std::chrono::milliseconds held) override;
  bool unplug() override;

  bool current_on() override { return !chip_->level("turntable-enable"); }
  bool lights_on() override { return chip_->level("lights"); }
  PanelState panel() override;
  std::optional<double> turned_deg() override;
  bool can_home() override { return true; }

 private:
  void step();
  void move_hand(std::stop_token stop);
  void move_button(bool down);

  SystemClock clock_;
  const bool bounces_;
  const TurntableConfig turntable_;
  std::unique_ptr<GpioSim> chip_ = make_gpio_sim_station();
  std::atomic<long> position_{0};
  std::atomic<long> steps_made_{0};
  std::atomic<bool> unplugged_{false};

  std::mutex mutex_;
  std::condition_variable_any pressed_;
  std::deque<std::chrono::milliseconds> presses_;

  StationHardware hardware_;
  std::jthread hand_;  // last: it uses everything above
};

}  // namespace skullstation
