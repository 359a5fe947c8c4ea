#include "tests/hardware_lab/gpio_sim_world.h"

#include <stdexcept>
#include <system_error>
#include <utility>

#include "core/units.h"
#include "tests/hardware_lab/watched_chip.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

/// The kernel tells edges that are closer together as one.
constexpr auto between_edges = 20ms;
/// Where the index flag begins, counter-clockwise from where the platter stands at first, and how
/// wide it is.
constexpr double flag_begins_deg = 40.0;
constexpr double flag_width_deg = 6.0;

GpioStationConfig wiring(bool bounces) {
  GpioStationConfig config = gpio_sim_wiring();
  // Long beside the gaps between edges, even on a busy machine; shorter than any press.
  config.button_timing.debounce = bounces ? 200ms : 60ms;
  return config;
}

}  // namespace

GpioStationConfig gpio_sim_wiring() {
  GpioStationConfig config;
  config.door.name = "door";
  for (GpioWire* wire : {&config.home, &config.estop, &config.door, &config.button}) {
    wire->bias = GpioBias::as_wired;
  }
  return config;
}

std::unique_ptr<GpioSim> make_gpio_sim_station(const std::string& name) {
  const GpioStationConfig wires = gpio_sim_wiring();
  auto chip = std::make_unique<GpioSim>(
      name, std::vector<std::string>{wires.step.name, wires.direction.name, wires.enable.name,
                                     wires.home.name, wires.estop.name, wires.door.name,
                                     wires.button.name, wires.green.name, wires.yellow.name,
                                     wires.red.name, wires.buzzer.name, wires.lights.name});
  for (const GpioWire& wire : {wires.enable, wires.home, wires.button}) chip->pull(wire.name, true);
  return chip;
}

GpioSimWorld::GpioSimWorld(const contract::WorldOptions& options)
    : bounces_(options.button_bounces), turntable_(contract::hurried(options.turntable)) {
  const GpioStationConfig wires = wiring(bounces_);
  GpioLines::Chips chips;
  chips.push_back(open_watched_chip(chip_->device_path(), wires.step.name, [this] {
    try {
      step();
    } catch (const std::system_error&) {
      if (!unplugged_) throw;  // a chip that is going away ends in the middle of a step
    }
  }));
  auto opened = open_gpio_station(wires, turntable_, clock_, GpioLines(std::move(chips)));
  if (!opened) throw std::runtime_error(opened.error().message());
  hardware_ = *std::move(opened);
  hand_ = std::jthread([this](std::stop_token stop) { move_hand(stop); });
}

GpioSimWorld::~GpioSimWorld() = default;

void GpioSimWorld::wait_for_steps(long steps_made) {
  while (steps_made_ < steps_made) std::this_thread::yield();
}

bool GpioSimWorld::open_door() {
  chip_->pull("door", true);
  return true;
}

bool GpioSimWorld::close_door() {
  chip_->pull("door", false);
  return true;
}

bool GpioSimWorld::unplug() {
  unplugged_ = true;
  chip_->remove();
  return true;
}

void GpioSimWorld::press_button(std::chrono::milliseconds held) {
  {
    const std::lock_guard lock(mutex_);
    presses_.push_back(held);
  }
  pressed_.notify_one();
}

PanelState GpioSimWorld::panel() {
  return {chip_->level("lamp-green"), chip_->level("lamp-yellow"), chip_->level("lamp-red"),
          chip_->level("buzzer")};
}

std::optional<double> GpioSimWorld::turned_deg() {
  return static_cast<double>(position_) * turntable_.limits.step_deg();
}

/// The motor at a rising edge of its step line, on the thread that raised it.
void GpioSimWorld::step() {
  if (!current_on()) return;
  const bool forward = chip_->level("turntable-dir") != turntable_.reversed;
  position_ += forward ? 1 : -1;
  const bool at_flag = wrapped_deg(*turned_deg() - flag_begins_deg) < flag_width_deg;
  chip_->pull("turntable-home", !at_flag);
  ++steps_made_;
}

void GpioSimWorld::move_hand(std::stop_token stop) {
  for (;;) {
    std::chrono::milliseconds held;
    {
      std::unique_lock lock(mutex_);
      if (!pressed_.wait(lock, stop, [this] { return !presses_.empty(); })) return;
      held = presses_.front();
      presses_.pop_front();
    }
    move_button(true);
    clock_.sleep_for(held, stop);
    move_button(false);
    clock_.sleep_for(bounces_ ? 500ms : 150ms, stop);
  }
}

void GpioSimWorld::move_button(bool down) {
  chip_->pull("start-button", !down);
  for (int i = 0; bounces_ && i < 3; ++i) {
    for (const bool level : {down, !down}) {
      clock_.sleep_for(between_edges, {});
      chip_->pull("start-button", level);
    }
  }
}

}  // namespace skullstation
