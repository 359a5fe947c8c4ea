// The GPIO backend as the kernel sees it: pulses, levels, order and reaction by its own record.

#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "tests/hardware_lab/gpio_sim_world.h"
#include "tests/hardware_lab/kernel_trace.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

double milliseconds(Instant from, Instant to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

contract::WorldOptions fine_steps() {
  contract::WorldOptions options;
  options.turntable.limits.steps_per_turn = 1600;  // 90 deg are 400 steps
  options.turntable.limits.max_speed_deg_s = 90;   // and 4 times that, see hurried()
  return options;
}

/// The level of a line at a moment.
bool level_at(const std::vector<LineChange>& changes, Instant at) {
  bool high = false;
  for (const LineChange& change : changes) {
    if (change.at > at) break;
    high = change.high;
  }
  return high;
}

class GpioStationLab : public testing::Test {
 protected:
  Turntable& table() { return *world_.hardware().turntable; }
  Interlock& interlock() { return *world_.hardware().interlock; }
  int number(const std::string& line) { return world_.chip().global_number(line); }

  void home() {
    const auto homed = table().home({});
    if (!homed) throw std::runtime_error(homed.error().message());
  }

  GpioSimWorld world_{fine_steps()};
};

TEST_F(GpioStationLab, A400StepMoveIsExactly400PulsesForward) {
  home();
  const KernelTrace trace("gpio/gpio_value");
  ASSERT_TRUE(table().move_to(90, {}));
  const auto events = trace.events();
  EXPECT_EQ(rising_edges(events, number("turntable-step")).size(), 400u);
  EXPECT_EQ(changes_of_line(events, number("turntable-step")).size(), 800u);
  EXPECT_TRUE(world_.chip().level("turntable-dir"));
  EXPECT_TRUE(changes_of_line(events, number("turntable-enable")).empty()) << "current stays on";
}

TEST_F(GpioStationLab, BackwardMovesOvershootAndComeBackForward) {
  home();
  ASSERT_TRUE(table().move_to(90, {}));
  const KernelTrace trace("gpio/gpio_value");
  ASSERT_TRUE(table().move_to(0, {}));
  const auto events = trace.events();
  const auto direction = changes_of_line(events, number("turntable-dir"));
  int forward = 0;
  int backward = 0;
  for (const Instant step : rising_edges(events, number("turntable-step"))) {
    ++(level_at(direction, step) ? forward : backward);
  }
  EXPECT_EQ(backward, 416) << "400 and the backlash of 3.6 deg";
  EXPECT_EQ(forward, 16);
}

TEST_F(GpioStationLab, PulsesAreLongEnough) {
  home();
  const KernelTrace trace("gpio/gpio_value");
  ASSERT_TRUE(table().move_to(90, {}));
  const auto changes = changes_of_line(trace.events(), number("turntable-step"));
  std::chrono::duration<double> shortest = 1s;
  for (std::size_t i = 1; i < changes.size(); ++i) {
    if (changes[i - 1].high)
      shortest = std::min<decltype(shortest)>(shortest, changes[i].at - changes[i - 1].at);
  }
  std::cout << "shortest pulse " << shortest.count() * 1e6 << " us\n";
  EXPECT_GE(shortest, 4us) << "5 us are configured; the record counts whole microseconds";
}

TEST_F(GpioStationLab, CurrentComesBeforeTheFirstStepAndGoesAfterTheLast) {
  const KernelTrace trace("gpio/gpio_value");
  home();
  ASSERT_TRUE(table().release());
  EXPECT_FALSE(world_.current_on());
  const auto events = trace.events();
  const auto steps = rising_edges(events, number("turntable-step"));
  const auto enable = changes_of_line(events, number("turntable-enable"));  // low is on
  ASSERT_FALSE(steps.empty());
  ASSERT_FALSE(enable.empty());
  EXPECT_FALSE(level_at(enable, steps.front()));
  EXPECT_TRUE(enable.back().high);
  EXPECT_GT(enable.back().at, steps.back());
}

TEST_F(GpioStationLab, EmergencyStopEndsStepsAtOnce) {
  home();
  KernelTrace trace("gpio/gpio_value");
  const long begun = world_.steps_made();
  std::jthread hand([&] {
    world_.wait_for_steps(begun + 100);
    trace.mark("stop pressed");
    world_.press_estop();
  });
  const auto moved = table().move_to(179, {});
  hand.join();
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::hardware);
  EXPECT_THAT(moved.error().message(), HasSubstr("emergency stop"));
  EXPECT_TRUE(interlock().tripped());
  EXPECT_FALSE(table().angle_deg());

  // A second try, while latched, moves nothing.
  EXPECT_FALSE(table().home({}));

  const auto events = trace.events();
  const Instant pressed = time_of_mark(events, "stop pressed");
  const auto steps = rising_edges(events, number("turntable-step"));
  const auto enable = changes_of_line(events, number("turntable-enable"));
  const auto off = std::find_if(enable.begin(), enable.end(), [&](const LineChange& change) {
    return change.high && change.at > pressed;
  });
  ASSERT_NE(off, enable.end());
  const auto after = [&](Instant at) {
    return std::count_if(steps.begin(), steps.end(), [&](Instant step) { return step > at; });
  };
  std::cout << "emergency stop: current off " << milliseconds(pressed, off->at)
            << " ms after the edge, " << after(pressed) << " steps after it, " << after(off->at)
            << " without current\n";
  EXPECT_LE(after(off->at), 1) << "the one that was under way";
  EXPECT_LT(steps.size(), 796u) << "179 deg";
}

TEST_F(GpioStationLab, AChipThatGoesWhileMovingEndsTheMove) {
  home();
  contract::Bell tripped;
  interlock().on_trip(tripped.rope());
  const long begun = world_.steps_made();
  std::jthread hand([&] {
    world_.wait_for_steps(begun + 50);
    world_.unplug();
  });
  const auto moved = table().move_to(179, {});
  hand.join();
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::hardware);
  EXPECT_THAT(moved.error().message(), HasSubstr("GPIO chip is gone"));
  ASSERT_TRUE(tripped.heard());
  EXPECT_THAT(interlock().reason(), HasSubstr("GPIO chip is gone"));
  EXPECT_FALSE(interlock().reset());
  EXPECT_FALSE(table().angle_deg());
}

TEST_F(GpioStationLab, SteppingIsRealTime) {
  home();
  const SteppingDiagnostics diagnostics = table().diagnostics();
  EXPECT_EQ(diagnostics.not_real_time, "");
  EXPECT_EQ(diagnostics.steps, world_.steps_made());
  std::cout << "latest step "
            << std::chrono::duration<double, std::milli>(diagnostics.max_lateness).count()
            << " ms late, of " << diagnostics.steps << " steps\n";
}

class GpioOpeningLab : public testing::Test {
 protected:
  Result<StationHardware> open() { return open_gpio_station(config_, turntable_, clock_); }

  void expect_refused(const std::string& text) {
    const auto refused = open();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::hardware);
    EXPECT_THAT(refused.error().message(), HasSubstr(text));
  }

  SystemClock clock_;
  GpioStationConfig config_ = gpio_sim_wiring();
  TurntableConfig turntable_;
};

TEST_F(GpioOpeningLab, LinesAreFoundByNameOnAnyChip) {
  const GpioSim other("other", {"something", "else"});
  const auto station = make_gpio_sim_station();
  const auto opened = open();
  ASSERT_TRUE(opened) << opened.error().message();
  EXPECT_FALSE(opened->interlock->tripped());
}

TEST_F(GpioOpeningLab, UdevGivesTheChipToTheGroupGpio) {
  const auto station = make_gpio_sim_station();
  ASSERT_EQ(std::system("udevadm settle --timeout=60"), 0);
  struct stat node {};
  ASSERT_EQ(::stat(station->device_path().c_str(), &node), 0);
  const group* const gpio = ::getgrnam("gpio");
  ASSERT_NE(gpio, nullptr);
  EXPECT_EQ(node.st_gid, gpio->gr_gid);
  EXPECT_EQ(node.st_mode & 0777, 0660u);
}

TEST_F(GpioOpeningLab, AStopThatIsPressedAlreadyTrips) {
  const auto station = make_gpio_sim_station();
  station->pull("estop", true);
  const auto opened = open();
  ASSERT_TRUE(opened) << opened.error().message();
  EXPECT_TRUE(opened->interlock->tripped());
  EXPECT_THAT(opened->interlock->reason(), HasSubstr("emergency stop"));
}

TEST_F(GpioOpeningLab, ABrokenStopWireTrips) {
  const auto station = make_gpio_sim_station();
  config_.estop.bias = GpioBias::pull_up;  // nothing holds the line against it
  const auto opened = open();
  ASSERT_TRUE(opened) << opened.error().message();
  EXPECT_TRUE(opened->interlock->tripped());
  EXPECT_FALSE(opened->interlock->reset());
}

TEST_F(GpioOpeningLab, AMissingLineIsNamed) {
  const auto station = make_gpio_sim_station();
  config_.home.name = "turntable-index";
  expect_refused("turntable-index");
}

TEST_F(GpioOpeningLab, ALineInUseIsNamedWithItsUser) {
  const auto station = make_gpio_sim_station();
  const auto first = open();
  ASSERT_TRUE(first);
  expect_refused("is in use by \"skullstation\"");
}

TEST_F(GpioOpeningLab, ALineOnTwoChipsIsAmbiguousUntilTheChipIsNamed) {
  const auto station = make_gpio_sim_station();
  const auto spare = make_gpio_sim_station("spare");
  expect_refused("is on gpiochip");
  config_.chip = "spare";
  const auto opened = open();
  EXPECT_TRUE(opened) << opened.error().message();
}

TEST_F(GpioOpeningLab, AMissingChipIsNamed) {
  expect_refused("no GPIO chip");
  const auto station = make_gpio_sim_station();
  config_.chip = "gpiochip7";
  expect_refused("gpiochip7");
}

}  // namespace
}  // namespace skullstation
