#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <future>
#include <limits>
#include <thread>

#include "tests/contract/hardware_world.h"

namespace skullstation::contract {

/// What holds before the platter has a zero.
class TurntableContract : public HardwareContract {
 protected:
  double step_deg() { return world().turntable().limits.step_deg(); }

  /// Lets `move` run on a thread of its own until the platter has turned by 20 deg, then calls
  /// `meanwhile`; returns what the move returned.
  template <class Move, class Meanwhile>
  Result<void> interrupt(Move move, Meanwhile meanwhile) {
    const double start_deg = *world().turned_deg();
    auto moving = std::async(std::launch::async, move);
    while (std::abs(*world().turned_deg() - start_deg) < 20.0) {
      if (moving.wait_for(std::chrono::milliseconds{0}) == std::future_status::ready) {
        ADD_FAILURE() << "ended before it was interrupted";
        break;
      }
      std::this_thread::yield();
    }
    meanwhile();
    return moving.get();
  }
};

/// What holds for a homed platter.
class HomedTurntableContract : public TurntableContract {
 protected:
  void SetUp() override {
    if (!world().can_home()) GTEST_SKIP() << "no index switch";
    const auto homed = table().home({});
    ASSERT_TRUE(homed) << homed.error().message();
    zero_deg_ = *world().turned_deg();
  }

  double turned_deg() { return *world().turned_deg() - zero_deg_; }

  /// Round and round until something ends it.
  Result<void> keep_turning(std::stop_token stop) {
    Result<void> moved;
    for (int i = 1; moved && i < 1000; ++i) moved = table().move_to((i % 3) * 120.0, stop);
    return moved;
  }

 private:
  double zero_deg_ = 0.0;
};

TEST_P(TurntableContract, HasNoPositionBeforeHoming) {
  EXPECT_EQ(table().angle_deg(), std::nullopt);
  const auto moved = table().move_to(10, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::hardware);
  EXPECT_THAT(moved.error().message(), testing::HasSubstr("home"));
  EXPECT_FALSE(world().current_on());
}

TEST_P(TurntableContract, DoesNotMoveWhileTripped) {
  press_estop();
  const auto before_deg = world().turned_deg();
  const auto homed = table().home({});
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().kind, ErrorKind::hardware);
  EXPECT_THAT(homed.error().message(), testing::HasSubstr("emergency stop"));
  EXPECT_EQ(world().turned_deg(), before_deg);
  EXPECT_FALSE(world().current_on());
}

TEST_P(TurntableContract, StoppedHomingHasNoPosition) {
  std::stop_source stop;
  stop.request_stop();
  const auto homed = table().home(stop.get_token());
  ASSERT_FALSE(homed);
  EXPECT_EQ(homed.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(table().angle_deg(), std::nullopt);
  EXPECT_FALSE(world().current_on());
}

TEST_P(HomedTurntableContract, StandsAtZero) { EXPECT_EQ(table().angle_deg(), 0.0); }

TEST_P(HomedTurntableContract, HomesToTheSamePlaceAgain) {
  ASSERT_TRUE(table().move_to(200, {}));
  ASSERT_TRUE(table().home({}));
  EXPECT_NEAR(std::remainder(turned_deg(), 360.0), 0.0, 1.01 * step_deg());
}

TEST_P(HomedTurntableContract, TurnsTheShortWay) {
  struct Move {
    double to_deg, turned_deg;
  };
  for (const auto& [to_deg, expected_deg] :
       {Move{90, 90}, Move{45, 45}, Move{350, -10}, Move{10, 10}, Move{-30, -30}, Move{120, 120}}) {
    ASSERT_TRUE(table().move_to(to_deg, {}));
    EXPECT_NEAR(*table().angle_deg(), to_deg < 0 ? to_deg + 360 : to_deg, 0.51 * step_deg());
    EXPECT_NEAR(turned_deg(), expected_deg, 0.51 * step_deg()) << "to " << to_deg;
  }
}

TEST_P(HomedTurntableContract, DoesNotDrift) {
  // 7.3 deg is no whole number of steps: each view is rounded, none adds to the next.
  for (int i = 1; i <= 50; ++i) ASSERT_TRUE(table().move_to(std::fmod(7.3 * i, 360.0), {}));
  EXPECT_NEAR(turned_deg(), 365.0, 0.51 * step_deg());
  ASSERT_TRUE(table().move_to(0, {}));
  EXPECT_NEAR(turned_deg(), 360.0, 0.01);
  EXPECT_EQ(table().angle_deg(), 0.0);
}

TEST_P(HomedTurntableContract, RefusesWhatIsNoAngle) {
  for (const double angle_deg : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    const auto moved = table().move_to(angle_deg, {});
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().kind, ErrorKind::bad_input);
  }
  EXPECT_EQ(table().angle_deg(), 0.0);
}

TEST_P(HomedTurntableContract, StopRequestLosesNoStep) {
  std::stop_source stop;
  const auto moved =
      interrupt([&] { return keep_turning(stop.get_token()); }, [&] { stop.request_stop(); });
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::cancelled);
  ASSERT_TRUE(table().angle_deg());
  EXPECT_NEAR(std::remainder(turned_deg() - *table().angle_deg(), 360.0), 0.0,
              world().turntable().backlash_deg);
  ASSERT_TRUE(table().move_to(90, {}));
  EXPECT_NEAR(std::remainder(turned_deg() - 90.0, 360.0), 0.0, 0.51 * step_deg());
}

TEST_P(HomedTurntableContract, EmergencyStopLosesThePosition) {
  const auto moved = interrupt([&] { return keep_turning({}); }, [&] { world().press_estop(); });
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::hardware);
  EXPECT_THAT(moved.error().message(), testing::HasSubstr("emergency stop"));
  EXPECT_FALSE(table().angle_deg());
  EXPECT_FALSE(world().current_on());

  world().release_estop();
  ASSERT_TRUE(interlock().reset());
  EXPECT_FALSE(table().move_to(10, {})) << "homing first";
  ASSERT_TRUE(table().home({}));
  EXPECT_NEAR(std::remainder(turned_deg(), 360.0), 0.0, 1.01 * step_deg());
}

TEST_P(HomedTurntableContract, EmergencyStopAtRestLosesThePositionToo) {
  press_estop();
  EXPECT_FALSE(table().angle_deg());
  world().release_estop();
  ASSERT_TRUE(interlock().reset());
  EXPECT_FALSE(table().angle_deg()) << "the current was off meanwhile";
}

TEST_P(HomedTurntableContract, ReleasingSwitchesTheCurrentOff) {
  EXPECT_TRUE(world().current_on());
  ASSERT_TRUE(table().release());
  EXPECT_FALSE(world().current_on());
  EXPECT_FALSE(table().angle_deg());
  EXPECT_FALSE(table().move_to(10, {}));
}

TEST_P(HomedTurntableContract, StepsAreCounted) {
  const long before = table().diagnostics().steps;
  ASSERT_TRUE(table().move_to(90, {}));
  EXPECT_EQ(table().diagnostics().steps - before, std::lround(90 / step_deg()));
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(TurntableContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(HomedTurntableContract);

}  // namespace skullstation::contract
