#include "firmware_io/gpio_station.h"

#include <fmt/format.h>
#include <sys/eventfd.h>

#include <array>
#include <cerrno>
#include <set>
#include <system_error>
#include <utility>

#include "firmware_io/gpio_panel.h"
#include "firmware_io/real_time.h"
#include "firmware_io/signal_player.h"
#include "firmware_io/step_driver.h"
#include "firmware_io/stepped_turntable.h"
#include "firmware_io/trip_latch.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

class GpioStepDriver final : public StepDriver {
 public:
  GpioStepDriver(std::shared_ptr<GpioPanel> panel, NamedLine step, NamedLine direction,
                 NamedLine home, std::chrono::microseconds pulse, bool reversed)
      : panel_(std::move(panel)),
        step_(std::move(step)),
        direction_(std::move(direction)),
        home_(std::move(home)),
        pulse_(pulse),
        reversed_(reversed) {}

  Result<void> set_current(bool on) override { return panel_->enable(on); }
  Result<void> set_direction(int direction) override {
    return direction_.set((direction > 0) != reversed_);
  }
  Result<void> step() override {
    if (auto up = step_.set(true); !up) return up;
    // Too short to sleep through.
    const auto end = std::chrono::steady_clock::now() + pulse_;
    while (std::chrono::steady_clock::now() < end) {
    }
    return step_.set(false);
  }
  Result<bool> index_closed() override { return home_.active(); }
  Result<void> prepare_thread() override { return make_this_thread_real_time(stepping_priority); }
  void wait_until(Instant deadline) override { sleep_exactly_until(deadline); }

 private:
  std::shared_ptr<GpioPanel> panel_;
  NamedLine step_;
  NamedLine direction_;
  NamedLine home_;
  std::chrono::microseconds pulse_;
  bool reversed_;
};

class GpioButton final : public Button {
 public:
  explicit GpioButton(std::shared_ptr<GpioPanel> panel) : panel_(std::move(panel)) {}
  Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                              std::stop_token stop) override {
    return panel_->wait_for_press(timeout, stop);
  }

 private:
  std::shared_ptr<GpioPanel> panel_;
};

class GpioLights final : public Lights {
 public:
  explicit GpioLights(NamedLine line) : line_(std::move(line)) {}
  ~GpioLights() override { static_cast<void>(line_.set(false)); }
  GpioLights(const GpioLights&) = delete;
  GpioLights& operator=(const GpioLights&) = delete;
  Result<void> set(bool on) override { return line_.set(on); }

 private:
  NamedLine line_;
};

/// Lamps and buzzer, in the order of PanelState.
using LampLines = std::array<NamedLine, 4>;

Result<void> apply_panel(LampLines& lines, const PanelState& state) {
  const std::array states{state.green, state.yellow, state.red, state.buzzer};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (auto set = lines[i].set(states[i]); !set) return set;
  }
  return {};
}

Result<void> in_table(const char* table, Result<void> valid) {
  if (!valid) valid.error().where = fmt::format("{}.{}", table, valid.error().where);
  return valid;
}

/// Hands each line over until the first failure, which it keeps.
class Fitter {
 public:
  template <class Request>
  NamedLine operator()(Request request) {
    if (!ok_) return {};
    Result<NamedLine> line = request();
    if (line) return *std::move(line);
    ok_ = forward(line);
    return {};
  }
  const Result<void>& ok() const { return ok_; }

 private:
  Result<void> ok_;
};

}  // namespace

Result<void> GpioStationConfig::validate() const {
  const std::array required{std::pair{"step", &step},     std::pair{"direction", &direction},
                            std::pair{"enable", &enable}, std::pair{"home", &home},
                            std::pair{"estop", &estop},   std::pair{"button", &button}};
  const std::array optional{std::pair{"door", &door},     std::pair{"green", &green},
                            std::pair{"yellow", &yellow}, std::pair{"red", &red},
                            std::pair{"buzzer", &buzzer}, std::pair{"lights", &lights}};
  std::set<std::string> names;
  const auto used_twice = [&](const char* key, const GpioWire& wire) -> Result<void> {
    if (wire.name.empty() || names.insert(wire.name).second) return {};
    return fail(ErrorKind::bad_input, fmt::format("{}.line", key),
                fmt::format("\"{}\" is the name of another line too", wire.name),
                "give each end its own line");
  };
  for (const auto& [key, wire] : required) {
    if (wire->name.empty()) {
      return fail(ErrorKind::bad_input, fmt::format("{}.line", key),
                  "is empty; this line must be fitted", "`gpioinfo` lists the lines");
    }
    if (auto ok = used_twice(key, *wire); !ok) return ok;
  }
  for (const auto& [key, wire] : optional) {
    if (auto ok = used_twice(key, *wire); !ok) return ok;
  }
  if (step_pulse < 2us || step_pulse > 200us) {
    return fail(ErrorKind::bad_input, "step_pulse_us",
                fmt::format("is {}; 2 to 200 was expected", step_pulse.count()));
  }
  return button_timing.validate();
}

Result<StationHardware> open_gpio_station(const GpioStationConfig& config,
                                          const TurntableConfig& turntable, Clock& clock) {
  auto lines = GpioLines::open(config.chip);
  if (!lines) return forward(lines);
  return open_gpio_station(config, turntable, clock, *std::move(lines));
}

Result<StationHardware> open_gpio_station(const GpioStationConfig& config,
                                          const TurntableConfig& turntable, Clock& clock,
                                          GpioLines lines) {
  if (auto ok = in_table("gpio", config.validate()); !ok) return forward(ok);
  if (auto ok = in_table("turntable", turntable.validate()); !ok) return forward(ok);

  Fitter fit;
  const auto output = [&](const GpioWire& wire) { return fit([&] { return lines.output(wire); }); };
  const auto input = [&](const GpioWire& wire) { return fit([&] { return lines.input(wire); }); };
  const auto edges = [&](const GpioWire& wire) {
    return fit([&] { return lines.input_with_edges(wire); });
  };
  NamedLine enable = output(config.enable);  // first: the motor's current is off
  NamedLine step = output(config.step);
  NamedLine direction = output(config.direction);
  NamedLine home = input(config.home);
  NamedLine estop = edges(config.estop);
  NamedLine door = edges(config.door);
  NamedLine button = edges(config.button);
  auto lamps = std::make_shared<LampLines>(LampLines{output(config.green), output(config.yellow),
                                                     output(config.red), output(config.buzzer)});
  NamedLine lights = output(config.lights);
  if (!fit.ok()) return forward(fit.ok());

  const int wake_fd = ::eventfd(0, EFD_CLOEXEC);
  if (wake_fd < 0) {
    return fail(ErrorKind::hardware, "GPIO", std::system_category().message(errno));
  }
  auto panel = std::make_shared<GpioPanel>(
      GpioPanelLines{std::move(estop), std::move(door), std::move(button), std::move(enable)},
      config.button_timing, clock, wake_fd);
  const std::shared_ptr<TripLatch> latch(panel, &panel->latch());
  return StationHardware{
      std::make_unique<LatchedInterlock>(latch), std::make_unique<GpioButton>(panel),
      std::make_unique<SignalPlayer>(
          [lamps](PanelState state) { return apply_panel(*lamps, state); }),
      std::make_unique<GpioLights>(std::move(lights)),
      std::make_unique<SteppedTurntable>(
          std::make_unique<GpioStepDriver>(panel, std::move(step), std::move(direction),
                                           std::move(home), config.step_pulse, turntable.reversed),
          latch, turntable, clock)};
}

}  // namespace skullstation
