#include "core/clock.h"
#include "firmware_io/simulated_station.h"
#include "tests/contract/interlock_contract.h"
#include "tests/contract/panel_contract.h"
#include "tests/contract/turntable_contract.h"

namespace skullstation::contract {
namespace {

SimulatedFaults faults_for(const WorldOptions& options) {
  SimulatedFaults faults;
  faults.button_bounces = options.button_bounces;
  return faults;
}

/// The simulated station in real time.
class SimulatedWorld final : public HardwareWorld {
 public:
  explicit SimulatedWorld(const WorldOptions& options)
      : config_(hurried(options.turntable)),
        station_(config_, faults_for(options), clock_, 11),
        hardware_(station_.hardware()) {}

  StationHardware& hardware() override { return hardware_; }
  const TurntableConfig& turntable() const override { return config_; }

  void press_estop() override { station_.press_estop(); }
  void release_estop() override { station_.release_estop(); }
  void press_button(std::chrono::milliseconds held) override { station_.press_button(held); }

  bool current_on() override { return station_.motor_current_on(); }
  bool lights_on() override { return station_.lights_on(); }
  PanelState panel() override {
    return panel_at(station_.shown_signal(), std::chrono::milliseconds{0});
  }
  std::optional<double> turned_deg() override {
    const auto settling = std::chrono::seconds{2};
    return station_.true_table_angle_deg(clock_.now() + settling);
  }
  bool can_home() override { return true; }

 private:
  SystemClock clock_;
  TurntableConfig config_;
  SimulatedStation station_;
  StationHardware hardware_;
};

const auto simulated =
    testing::Values(HardwareKind{"Simulated", [](const WorldOptions& options) {
                                   return std::make_unique<SimulatedWorld>(options);
                                 }});

INSTANTIATE_TEST_SUITE_P(Hardware, InterlockContract, simulated, name_of);
INSTANTIATE_TEST_SUITE_P(Hardware, PanelContract, simulated, name_of);
INSTANTIATE_TEST_SUITE_P(Hardware, TurntableContract, simulated, name_of);
INSTANTIATE_TEST_SUITE_P(Hardware, HomedTurntableContract, simulated, name_of);

}  // namespace
}  // namespace skullstation::contract
