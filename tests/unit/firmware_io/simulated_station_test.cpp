#include "firmware_io/simulated_station.h"

#include <gmock/gmock.h>

#include <cmath>
#include <thread>

#include "core/units.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;

struct Station {
  explicit Station(const TurntableConfig& config = {}, const SimulatedFaults& faults = {},
                   std::uint64_t seed = 1)
      : world(config, faults, clock, seed), hardware(world.hardware()) {}

  /// Settled: the platter's ringing has died away.
  double settled_angle_deg() {
    clock.sleep_for(2s, {});
    return world.true_table_angle_deg(clock.now());
  }

  SimulatedClock clock;
  SimulatedStation world;
  StationHardware hardware;
};

double angle_error_deg(double true_deg, double expected_deg) {
  return std::abs(turn_deg(expected_deg, true_deg));
}

TEST(SimulatedStation, HomesToTheTrueZeroFromAnywhere) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    TurntableConfig config;
    config.home_offset_deg = 7.0 * static_cast<double>(seed) - 60.0;
    Station station(config, {}, seed);
    ASSERT_TRUE(station.hardware.turntable->home({}));
    EXPECT_EQ(station.hardware.turntable->angle_deg(), 0.0);
    EXPECT_LT(angle_error_deg(station.settled_angle_deg(), 0.0), 1e-6) << "seed " << seed;
  }
}

TEST(SimulatedStation, EveryViewStandsWhereTheTurntableSays) {
  Station station;
  auto& table = *station.hardware.turntable;
  ASSERT_TRUE(table.home({}));
  for (int pass = 0; pass < 2; ++pass) {
    for (int view = 0; view < 48; ++view) {
      ASSERT_TRUE(table.move_to(view * 7.5, {}));
      const double true_deg = station.settled_angle_deg();
      EXPECT_LT(angle_error_deg(true_deg, *table.angle_deg()), 1e-6);
      EXPECT_LT(angle_error_deg(true_deg, view * 7.5), 0.5 * 360 / 6400 + 1e-6);
    }
  }
}

TEST(SimulatedStation, RingsAfterAStopAndSettles) {
  Station station;
  auto& table = *station.hardware.turntable;
  ASSERT_TRUE(table.home({}));
  ASSERT_TRUE(table.move_to(90, {}));
  const Instant stopped = station.clock.now();
  const double rest_deg = station.settled_angle_deg();
  const auto swing_deg = [&](Instant from, Instant to) {
    double largest = 0;
    for (Instant t = from; t < to; t += 1ms) {
      largest = std::max(largest, std::abs(station.world.true_table_angle_deg(t) - rest_deg));
    }
    return largest;
  };
  EXPECT_GT(swing_deg(stopped, stopped + 100ms), 0.02);
  EXPECT_LT(swing_deg(stopped, stopped + 100ms), 0.06);
  EXPECT_LT(swing_deg(stopped + 300ms, stopped + 400ms), 0.001);
}

TEST(SimulatedStation, RemembersTheWayAndItsTime) {
  Station station;
  auto& table = *station.hardware.turntable;
  ASSERT_TRUE(table.home({}));
  const Instant start = station.clock.now();
  const double start_deg = station.settled_angle_deg();
  const Instant moving = station.clock.now();
  ASSERT_TRUE(table.move_to(170, {}));
  const Instant end = station.clock.now();
  // 170 deg with the default limits: 0.75 s more than at full speed throughout. The first step
  // falls as long after the start as the last one before the end.
  const double first_s = std::cbrt(3 * 360.0 / 6400 / 240);
  EXPECT_NEAR(std::chrono::duration<double>(end - moving).count(), 170.0 / 30 + 0.75 - first_s,
              0.01);
  const Instant middle = moving + (end - moving) / 2 + 1ms * std::lround(500 * first_s);
  EXPECT_NEAR(station.world.true_table_angle_deg(start + 1s), start_deg, 1e-3);
  EXPECT_NEAR(station.world.true_table_angle_deg(middle), start_deg + 85, 0.2);
  EXPECT_NEAR(station.world.true_table_angle_deg(end + 5s), start_deg + 170, 0.03);
  EXPECT_NO_FATAL_FAILURE(station.world.true_table_angle_deg(Instant::min()));
}

TEST(SimulatedStation, SlipReachesThePlatterOnly) {
  SimulatedFaults faults;
  faults.slip_fraction = 0.02;
  Station station({}, faults);
  auto& table = *station.hardware.turntable;
  ASSERT_TRUE(table.home({}));
  const double zero_deg = station.settled_angle_deg();
  ASSERT_TRUE(table.move_to(120, {}));
  ASSERT_TRUE(table.move_to(240, {}));
  EXPECT_NEAR(*table.angle_deg(), 240, 0.03);
  EXPECT_NEAR(station.settled_angle_deg() - zero_deg, 0.98 * 240, 0.05);
}

TEST(SimulatedStation, StallLeavesThePlatterWhereItStuck) {
  SimulatedFaults faults;
  faults.stall_at_deg = 500;
  Station station({}, faults);
  auto& table = *station.hardware.turntable;
  ASSERT_TRUE(table.home({}));
  for (int i = 1; i <= 6; ++i) ASSERT_TRUE(table.move_to(wrapped_deg(120.0 * i), {}));
  const double stuck_deg = station.settled_angle_deg();
  ASSERT_TRUE(table.move_to(90, {}));
  EXPECT_EQ(station.settled_angle_deg(), stuck_deg);
}

TEST(SimulatedStation, MissingIndexSwitchFailsHomingWithTheMotorOff) {
  SimulatedFaults faults;
  faults.index_switch_missing = true;
  Station station({}, faults);
  const auto homed = station.hardware.turntable->home({});
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().kind, ErrorKind::hardware);
  EXPECT_THAT(homed.error().message(), testing::HasSubstr("index switch never seen in 400 deg"));
  EXPECT_FALSE(station.world.motor_current_on());
  EXPECT_FALSE(station.hardware.turntable->angle_deg());
}

TEST(SimulatedStation, EmergencyStopAtAGivenTurn) {
  SimulatedFaults faults;
  faults.estop_after_turn_deg = 450;
  Station station({}, faults, 3);
  auto& table = *station.hardware.turntable;
  ASSERT_TRUE(table.home({}));
  Result<void> moved;
  for (int i = 1; moved && i <= 6; ++i) moved = table.move_to(wrapped_deg(120.0 * i), {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::hardware);
  EXPECT_THAT(moved.error().message(), testing::HasSubstr("emergency stop pressed"));
  EXPECT_TRUE(station.hardware.interlock->tripped());
  EXPECT_FALSE(station.world.motor_current_on());
  EXPECT_FALSE(table.angle_deg());

  EXPECT_FALSE(table.home({})) << "still pressed";
  EXPECT_FALSE(station.hardware.interlock->reset());
  station.world.release_estop();
  EXPECT_FALSE(table.home({})) << "released, but still latched";
  ASSERT_TRUE(station.hardware.interlock->reset());
  ASSERT_TRUE(table.home({}));
  EXPECT_LT(angle_error_deg(station.settled_angle_deg(), 0.0), 1e-6);
}

TEST(SimulatedStation, StuckEmergencyStopCannotBeReset) {
  SimulatedFaults faults;
  faults.estop_stuck = true;
  Station station({}, faults);
  station.world.press_estop();
  station.world.release_estop();
  const auto reset = station.hardware.interlock->reset();
  ASSERT_FALSE(reset);
  EXPECT_THAT(reset.error().message(), testing::HasSubstr("emergency stop pressed"));
  EXPECT_TRUE(station.hardware.interlock->tripped());
}

TEST(SimulatedStation, ButtonTellsBriefFromHeldEvenWhenItBounces) {
  for (const bool bounces : {false, true}) {
    SimulatedFaults faults;
    faults.button_bounces = bounces;
    Station station({}, faults);
    auto& button = *station.hardware.button;
    for (int i = 0; i < 20; ++i) {
      station.world.press_button(200ms);
      station.world.press_button(2s);
    }
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(*button.wait_for_press(1min, {}), Press::brief);
      EXPECT_EQ(*button.wait_for_press(1min, {}), Press::held);
    }
    EXPECT_EQ(*button.wait_for_press(1min, {}), std::nullopt);
  }
}

TEST(SimulatedStation, HeldIsToldWhileTheButtonIsStillDown) {
  Station station;
  const Instant down = station.clock.now();
  station.world.press_button(10s);
  ASSERT_EQ(*station.hardware.button->wait_for_press(1min, {}), Press::held);
  EXPECT_EQ(station.clock.now(), down + 1500ms);
}

TEST(SimulatedStation, WaitingForThePressEndsOnAPressAndOnAStopRequest) {
  SystemClock clock;
  SimulatedStation world({}, {}, clock, 1);
  auto hardware = world.hardware();
  std::jthread hand([&] { world.press_button(30ms); });
  EXPECT_EQ(*hardware.button->wait_for_press(1h, {}), Press::brief);

  std::stop_source stop;
  std::jthread other([&] { stop.request_stop(); });
  EXPECT_EQ(*hardware.button->wait_for_press(1h, stop.get_token()), std::nullopt);
}

TEST(SimulatedStation, ShowsWhatAnEyeWouldSee) {
  Station station;
  EXPECT_EQ(station.world.shown_signal(), Signal::off);
  ASSERT_TRUE(station.hardware.lamp->show(Signal::attention));
  EXPECT_EQ(station.world.shown_signal(), Signal::attention);
  EXPECT_FALSE(station.world.lights_on());
  ASSERT_TRUE(station.hardware.lights->set(true));
  EXPECT_TRUE(station.world.lights_on());
  ASSERT_TRUE(station.hardware.turntable->home({}));
  EXPECT_TRUE(station.world.motor_current_on());
  ASSERT_TRUE(station.hardware.turntable->release());
  EXPECT_FALSE(station.world.motor_current_on());
}

TEST(SimulatedStation, ReleasedPlatterMayBeTurnedUnlessTheGearHoldsIt) {
  for (const bool holds : {false, true}) {
    TurntableConfig config;
    config.holds_without_current = holds;
    Station station(config);
    auto& table = *station.hardware.turntable;
    ASSERT_TRUE(table.home({}));
    const double before_deg = station.settled_angle_deg();
    ASSERT_TRUE(table.release());
    EXPECT_EQ(station.settled_angle_deg() == before_deg, holds);
    EXPECT_EQ(table.angle_deg().has_value(), holds);
    EXPECT_EQ(table.move_to(30, {}).has_value(), holds);
  }
}

TEST(SimulatedStation, SameSeedSameStory) {
  const auto story = [] {
    SimulatedFaults faults;
    faults.button_bounces = true;
    Station station({}, faults, 42);
    station.world.press_button(100ms);
    static_cast<void>(station.hardware.turntable->home({}));
    static_cast<void>(station.hardware.turntable->move_to(77, {}));
    return std::pair(station.clock.now(), station.world.true_table_angle_deg(station.clock.now()));
  };
  EXPECT_EQ(story(), story());
}

}  // namespace
}  // namespace skullstation
