#include "firmware_io/gpio_station.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "firmware_io/real_time.h"
#include "firmware_io/signal_player.h"
#include "firmware_io/step_driver.h"
#include "firmware_io/stepped_turntable.h"
#include "firmware_io/trip_latch.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr auto chip_gone_text = "GPIO chip is gone";
constexpr std::chrono::milliseconds longest_wait = std::chrono::hours{24 * 365};
/// The levels are looked at this often even if no edge was told of (kernels before 6.6 don't wake
/// a poll when a chip is removed, and a full edge queue drops edges).
constexpr auto level_check_period = 250ms;

/// The panel's inputs, the motor's enable line, and the thread that hears their edges.
class Panel {
 public:
  Panel(NamedLine estop, NamedLine door, NamedLine button, NamedLine enable,
        const ButtonTiming& button_timing, Clock& clock, int wake_fd)
      : estop_(std::move(estop)),
        door_(std::move(door)),
        button_(std::move(button)),
        enable_(std::move(enable)),
        clock_(clock),
        wake_fd_(wake_fd),
        detector_(button_timing),
        latch_({[this] { return still_active(); }, [this] { cut_current(); }}) {
    trip_if_active();
    listener_ = std::jthread([this] { listen(); });
  }

  ~Panel() {
    ::eventfd_write(wake_fd_, 1);
    listener_.join();
    ::close(wake_fd_);
  }
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  TripLatch& latch() { return latch_; }

  Result<void> enable(bool on) { return enable_.set(on); }

  Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                              std::stop_token stop) {
    const Instant deadline = clock_.now() + std::min(timeout, longest_wait);
    std::unique_lock lock(mutex_);
    pressed_.wait_until(lock, stop, deadline, [&] { return !presses_.empty() || deaf_; });
    if (!presses_.empty()) {
      const Press press = presses_.front();
      presses_.pop_front();
      return press;
    }
    if (deaf_) return tl::unexpected(*deaf_);
    return std::nullopt;
  }

 private:
  Result<std::string> still_active() {
    for (auto [line, text] :
         {std::pair{&estop_, "emergency stop pressed"}, std::pair{&door_, "door open"}}) {
      const auto active = line->active();
      if (!active) return forward(active);
      if (*active) return text;
    }
    return "";
  }

  void cut_current() {
    // If the line can't be reached, the turntable's next step fails with the reason.
    static_cast<void>(enable_.set(false));
  }

  /// False if the lines can't be read any more.
  bool trip_if_active() {
    const auto active = still_active();
    if (!active) {
      go_deaf(active.error());
    } else if (!active->empty()) {
      latch_.trip(*active);
    }
    return active.has_value();
  }

  void go_deaf(Error error) {
    {
      const std::lock_guard lock(mutex_);
      deaf_ = std::move(error);
    }
    pressed_.notify_all();
    latch_.trip(chip_gone_text);
  }

  void listen() {
    // Best effort: how stepping itself fares is in the turntable's diagnostics.
    static_cast<void>(make_this_thread_real_time(interlock_priority));
    const auto poll_for = [](int fd) { return pollfd{fd, POLLIN, 0}; };  // fd < 0 is passed over
    std::array fds{poll_for(wake_fd_), poll_for(estop_.edge_fd()), poll_for(door_.edge_fd()),
                   poll_for(button_.edge_fd())};
    const auto& [woken, estop, door, button] = fds;
    for (;;) {
      const Instant before = clock_.now();
      if (::poll(fds.data(), fds.size(), milliseconds_to_wait(before)) < 0 && errno != EINTR) {
        return go_deaf({ErrorKind::hardware, "GPIO", std::system_category().message(errno), ""});
      }
      if (woken.revents != 0) return;
      const bool hung_up = std::ranges::any_of(
          fds, [](const pollfd& fd) { return (fd.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0; });
      if (hung_up) {
        return go_deaf({ErrorKind::hardware, "GPIO", chip_gone_text,
                        "reconnect it, then start the station again"});
      }
      const bool heard = (estop.revents == 0 || hear_stop(estop_, "emergency stop pressed")) &&
                         (door.revents == 0 || hear_stop(door_, "door open")) &&
                         (button.revents == 0 || hear_button()) && trip_if_active();
      if (!heard) return;
      // With no edge queued, all that happened before the poll was heard.
      if (button.revents == 0) tell_presses(before);
    }
  }

  int milliseconds_to_wait(Instant now) const {
    const Instant next =
        std::min(detector_.next_decision().value_or(Instant::max()), now + level_check_period);
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next - now);
    return static_cast<int>(std::max(0ms, wait).count());
  }

  /// Not debounced: the first edge counts.
  bool hear_stop(NamedLine& line, const char* text) {
    const auto edge = line.read_edge();
    if (!edge) {
      go_deaf(edge.error());
    } else if (edge->active) {
      latch_.trip(text);
    }
    return edge.has_value();
  }

  bool hear_button() {
    const auto edge = button_.read_edge();
    if (!edge) {
      go_deaf(edge.error());
    } else {
      detector_.edge(edge->at, edge->active);
    }
    return edge.has_value();
  }

  void tell_presses(Instant until) {
    const auto detected = detector_.advance(until);
    if (detected.empty()) return;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& press : detected) presses_.push_back(press.press);
    }
    pressed_.notify_all();
  }

  NamedLine estop_;
  NamedLine door_;
  NamedLine button_;
  NamedLine enable_;
  Clock& clock_;
  const int wake_fd_;
  PressDetector detector_;  // the listener's own

  std::mutex mutex_;
  std::condition_variable_any pressed_;
  std::deque<Press> presses_;
  std::optional<Error> deaf_;  // why no edge will ever be heard again

  TripLatch latch_;
  std::jthread listener_;
};

class GpioStepDriver final : public StepDriver {
 public:
  GpioStepDriver(std::shared_ptr<Panel> panel, NamedLine step, NamedLine direction, NamedLine home,
                 std::chrono::microseconds pulse, bool reversed)
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
  std::shared_ptr<Panel> panel_;
  NamedLine step_;
  NamedLine direction_;
  NamedLine home_;
  std::chrono::microseconds pulse_;
  bool reversed_;
};

class GpioButton final : public Button {
 public:
  explicit GpioButton(std::shared_ptr<Panel> panel) : panel_(std::move(panel)) {}
  Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                              std::stop_token stop) override {
    return panel_->wait_for_press(timeout, stop);
  }

 private:
  std::shared_ptr<Panel> panel_;
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
  auto panel = std::make_shared<Panel>(std::move(estop), std::move(door), std::move(button),
                                       std::move(enable), config.button_timing, clock, wake_fd);
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
