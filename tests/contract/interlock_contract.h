#pragma once

#include <gmock/gmock.h>

#include <thread>

#include "tests/contract/hardware_world.h"

namespace skullstation::contract {

class InterlockContract : public HardwareContract {};

TEST_P(InterlockContract, StartsUntripped) {
  static_assert(noexcept(std::declval<const Interlock&>().tripped()));
  EXPECT_FALSE(interlock().tripped());
  EXPECT_EQ(interlock().reason(), "");
  EXPECT_TRUE(interlock().reset()) << "of what is not tripped does nothing";
}

TEST_P(InterlockContract, StaysLatchedUntilReset) {
  press_estop();
  EXPECT_TRUE(interlock().tripped());
  EXPECT_THAT(interlock().reason(), testing::HasSubstr("emergency stop"));

  const auto while_pressed = interlock().reset();
  ASSERT_FALSE(while_pressed);
  EXPECT_EQ(while_pressed.error().kind, ErrorKind::hardware);
  EXPECT_THAT(while_pressed.error().message(), testing::HasSubstr("emergency stop"));
  EXPECT_TRUE(interlock().tripped());

  world().release_estop();
  EXPECT_TRUE(interlock().tripped()) << "releasing the button is no reset";
  ASSERT_TRUE(interlock().reset());
  EXPECT_FALSE(interlock().tripped());
  EXPECT_EQ(interlock().reason(), "");
}

TEST_P(InterlockContract, TellsEachTripOnceOnItsOwnThread) {
  Bell tripped;
  std::thread::id told_on;
  interlock().on_trip([&] {
    told_on = std::this_thread::get_id();
    tripped.rope()();
  });
  for (int trip = 0; trip < 3; ++trip) {
    world().press_estop();
    ASSERT_TRUE(tripped.heard());
    EXPECT_NE(told_on, std::this_thread::get_id());
    world().press_estop();  // pressed anew while latched
    world().release_estop();
    ASSERT_TRUE(interlock().reset());
  }
  interlock().on_trip({});  // waits for one that is running
  EXPECT_TRUE(tripped.silent());
}

TEST_P(InterlockContract, CallbackCanBeReplacedAndTakenAway) {
  Bell first;
  Bell second;
  interlock().on_trip(first.rope());
  interlock().on_trip(second.rope());
  world().press_estop();
  EXPECT_TRUE(second.heard());
  EXPECT_TRUE(first.silent());
  interlock().on_trip({});
  world().release_estop();
  ASSERT_TRUE(interlock().reset());

  Bell third;
  interlock().on_trip([&] {
    interlock().on_trip({});  // from within
    third.rope()();
  });
  world().press_estop();
  EXPECT_TRUE(third.heard());
  EXPECT_TRUE(second.silent());
}

TEST_P(InterlockContract, CallbackMayAskAndReset) {
  Bell answered;
  Result<void> reset;
  std::string reason;
  interlock().on_trip([&] {
    reason = interlock().reason();
    reset = interlock().reset();
    answered.rope()();
  });
  world().press_estop();
  ASSERT_TRUE(answered.heard());
  EXPECT_THAT(reason, testing::HasSubstr("emergency stop"));
  EXPECT_FALSE(reset) << "it is still pressed";
}

TEST_P(InterlockContract, OpenDoorTripsToo) {
  Bell tripped;
  interlock().on_trip(tripped.rope());
  if (!world().open_door()) GTEST_SKIP() << "no door";
  ASSERT_TRUE(tripped.heard());
  EXPECT_THAT(interlock().reason(), testing::HasSubstr("door open"));
  EXPECT_FALSE(interlock().reset());
  world().close_door();
  EXPECT_TRUE(interlock().reset());
}

TEST_P(InterlockContract, LosingTheHardwareTripsForGood) {
  Bell tripped;
  interlock().on_trip(tripped.rope());
  if (!world().unplug()) GTEST_SKIP() << "can't be unplugged";
  ASSERT_TRUE(tripped.heard());
  EXPECT_THAT(interlock().reason(), testing::HasSubstr("GPIO chip is gone"));
  EXPECT_FALSE(interlock().reset());
  const auto press = button().wait_for_press(patience, {});
  ASSERT_FALSE(press);
  EXPECT_EQ(press.error().kind, ErrorKind::hardware);
  EXPECT_FALSE(table().home({}));
  EXPECT_FALSE(world().hardware().lamp->show(Signal::fault));
  EXPECT_FALSE(world().hardware().lights->set(true));
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(InterlockContract);

}  // namespace skullstation::contract
