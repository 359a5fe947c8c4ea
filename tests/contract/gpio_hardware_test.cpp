#include <stdexcept>

#include "core/clock.h"
#include "core/units.h"
#include "firmware_io/gpio_station.h"
#include "tests/contract/fake_gpio.h"
#include "tests/contract/interlock_contract.h"
#include "tests/contract/panel_contract.h"
#include "tests/contract/turntable_contract.h"

namespace skullstation::contract {
namespace {

using namespace std::chrono_literals;

GpioStationConfig wiring() {
  GpioStationConfig config;
  config.door.name = "door";
  return config;
}

/// A motor and its index switch, at the other end of the wires.
class WiredMotor {
 public:
  WiredMotor(FakeGpio& gpio, const GpioStationConfig& wires, const TurntableConfig& turntable)
      : gpio_(gpio), wires_(wires), turntable_(turntable) {}

  void hear(const std::string& line, bool high) {
    if (line != wires_.step.name || !high) return;
    const bool powered = gpio_.high(wires_.enable.name) != wires_.enable.active_low;
    if (!powered) return;
    const bool forward = gpio_.high(wires_.direction.name) != turntable_.reversed;
    steps_ += forward ? 1 : -1;
    gpio_.pull(wires_.home.name,
               (wrapped_deg(turned_deg() - 200.0) < 6.0) != wires_.home.active_low);
  }

  double turned_deg() const { return static_cast<double>(steps_) * turntable_.limits.step_deg(); }

 private:
  FakeGpio& gpio_;
  const GpioStationConfig& wires_;
  const TurntableConfig& turntable_;
  std::atomic<long> steps_{0};
};

/// The GPIO station on a chip in this process; the hardware lab has one on the kernel's own.
class FakeGpioWorld final : public HardwareWorld {
 public:
  explicit FakeGpioWorld(const WorldOptions& options)
      : bounces_(options.button_bounces), turntable_(hurried(options.turntable)) {
    turntable_.reversed = true;
    gpio_->on_output([this](const std::string& line, bool high) { motor_.hear(line, high); });
    auto opened =
        open_gpio_station(wires_, turntable_, clock_, GpioLines(FakeGpio::chips({gpio_})));
    if (!opened) throw std::runtime_error(opened.error().message());
    hardware_ = *std::move(opened);
  }

  StationHardware& hardware() override { return hardware_; }
  const TurntableConfig& turntable() const override { return turntable_; }

  void press_estop() override { gpio_->pull("estop", true); }
  void release_estop() override { gpio_->pull("estop", false); }
  bool open_door() override {
    gpio_->pull("door", true);
    return true;
  }
  bool close_door() override {
    gpio_->pull("door", false);
    return true;
  }
  bool unplug() override {
    gpio_->remove();
    return true;
  }
  /// All edges at once, with the time stamps that they would have.
  void press_button(std::chrono::milliseconds held) override {
    const Instant down = std::max(clock_.now(), button_free_at_);
    move_button(down, false);
    move_button(down + held, true);
    button_free_at_ = down + held + 100ms;
  }

  bool current_on() override { return !gpio_->high("turntable-enable"); }
  bool lights_on() override { return gpio_->high("lights"); }
  PanelState panel() override {
    return {gpio_->high("lamp-green"), gpio_->high("lamp-yellow"), gpio_->high("lamp-red"),
            gpio_->high("buzzer")};
  }
  std::optional<double> turned_deg() override { return motor_.turned_deg(); }
  bool can_home() override { return true; }

 private:
  void move_button(Instant at, bool high) {
    gpio_->pull("start-button", high, at);
    if (!bounces_) return;
    for (int i = 0; i < 3; ++i) {
      gpio_->pull("start-button", !high, at += 3ms);
      gpio_->pull("start-button", high, at += 2ms);
    }
  }

  SystemClock clock_;
  const bool bounces_;
  const GpioStationConfig wires_ = wiring();
  TurntableConfig turntable_;
  // Contacts to ground at rest: the stop's and the door's are closed, the others open.
  std::shared_ptr<FakeGpio> gpio_ =
      std::make_shared<FakeGpio>("gpiochip0", FakeGpio::Levels{{"turntable-step", false},
                                                               {"turntable-dir", false},
                                                               {"turntable-enable", true},
                                                               {"turntable-home", true},
                                                               {"estop", false},
                                                               {"door", false},
                                                               {"start-button", true},
                                                               {"lamp-green", false},
                                                               {"lamp-yellow", false},
                                                               {"lamp-red", false},
                                                               {"buzzer", false},
                                                               {"lights", false}});
  WiredMotor motor_{*gpio_, wires_, turntable_};
  Instant button_free_at_;
  StationHardware hardware_;
};

const auto fake_gpio =
    testing::Values(HardwareKind{"FakeGpio", [](const WorldOptions& options) {
                                   return std::make_unique<FakeGpioWorld>(options);
                                 }});

INSTANTIATE_TEST_SUITE_P(Hardware, InterlockContract, fake_gpio, name_of);
INSTANTIATE_TEST_SUITE_P(Hardware, PanelContract, fake_gpio, name_of);
INSTANTIATE_TEST_SUITE_P(Hardware, TurntableContract, fake_gpio, name_of);
INSTANTIATE_TEST_SUITE_P(Hardware, HomedTurntableContract, fake_gpio, name_of);

}  // namespace
}  // namespace skullstation::contract
