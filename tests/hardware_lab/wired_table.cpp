#include "tests/hardware_lab/wired_table.h"

#include <cstdio>

#include "core/units.h"
#include "tests/hardware_lab/kernel_trace.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

/// Where the index flag begins, counter-clockwise from where the platter stands at first, and how
/// wide it is.
constexpr double flag_begins_deg = 40.0;
constexpr double flag_width_deg = 10.0;

}  // namespace

WiredTable::WiredTable(GpioSim& chip, double steps_per_turn)
    : chip_(chip),
      step_deg_(360.0 / steps_per_turn),
      motor_([this](const std::stop_token& stop) { follow(stop); }) {}

void WiredTable::press_button(std::chrono::milliseconds held) {
  chip_.pull("start-button", false);
  std::this_thread::sleep_for(held);
  chip_.pull("start-button", true);
}

void WiredTable::follow(const std::stop_token& stop) {
  const int step = chip_.global_number("turntable-step");
  const int direction = chip_.global_number("turntable-dir");
  const int enable = chip_.global_number("turntable-enable");
  bool forward = false;
  bool current = false;
  long position = 0;
  LiveKernelTrace trace("gpio/gpio_value");
  while (!stop.stop_requested()) {
    for (const TraceEvent& event : trace.next(200ms)) {
      int line = -1;
      int level = 0;
      if (std::sscanf(event.text.c_str(), "%d set %d", &line, &level) != 2) continue;
      if (line == direction) forward = level == 1;
      if (line == enable) current = level == 0;
      if (line != step || level != 1 || !current) continue;
      position += forward ? 1 : -1;
      const double turned_deg = static_cast<double>(position) * step_deg_;
      chip_.pull("turntable-home", wrapped_deg(turned_deg - flag_begins_deg) >= flag_width_deg);
      ++steps_made_;
    }
  }
}

}  // namespace skullstation
