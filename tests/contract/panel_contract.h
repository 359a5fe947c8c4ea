#pragma once

#include <thread>

#include "tests/contract/hardware_world.h"

namespace skullstation::contract {

class PanelContract : public HardwareContract {
 protected:
  std::optional<Press> next_press() {
    const auto press = button().wait_for_press(patience, {});
    EXPECT_TRUE(press) << press.error().message();
    return press.value_or(std::nullopt);
  }
};

using namespace std::chrono_literals;

TEST_P(PanelContract, BriefPressIsToldOnce) {
  world().press_button(200ms);
  EXPECT_EQ(next_press(), Press::brief);
  EXPECT_EQ(*button().wait_for_press(0ms, {}), std::nullopt);
}

TEST_P(PanelContract, LongPressIsHeldAndNothingElse) {
  world().press_button(2500ms);
  world().press_button(200ms);
  EXPECT_EQ(next_press(), Press::held);
  EXPECT_EQ(next_press(), Press::brief) << "the end of the long press is no press";
}

TEST_P(PanelContract, PressesQueueUp) {
  for (int i = 0; i < 3; ++i) world().press_button(150ms);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(next_press(), Press::brief);
  EXPECT_EQ(*button().wait_for_press(0ms, {}), std::nullopt);
}

TEST_P(PanelContract, BouncingContactIsOnePress) {
  WorldOptions options;
  options.button_bounces = true;
  make(options);
  world().press_button(400ms);
  world().press_button(2500ms);
  EXPECT_EQ(next_press(), Press::brief);
  EXPECT_EQ(next_press(), Press::held);
  EXPECT_EQ(*button().wait_for_press(0ms, {}), std::nullopt);
}

TEST_P(PanelContract, WaitingEndsAtTheTimeOut) {
  EXPECT_EQ(*button().wait_for_press(0ms, {}), std::nullopt);
  EXPECT_EQ(*button().wait_for_press(5ms, {}), std::nullopt);
  EXPECT_EQ(*button().wait_for_press(-5ms, {}), std::nullopt);
}

TEST_P(PanelContract, WaitingEndsOnAStopRequest) {
  std::stop_source stop;
  auto& waiting = button();
  std::jthread hand([&stop] { stop.request_stop(); });
  EXPECT_EQ(*waiting.wait_for_press(std::chrono::milliseconds::max(), stop.get_token()),
            std::nullopt);
}

TEST_P(PanelContract, EachSignalLightsItsLamp) {
  auto& lamp = *world().hardware().lamp;
  EXPECT_EQ(world().panel(), PanelState{}) << "dark until something is shown";
  for (const Signal signal : {Signal::ready, Signal::working, Signal::attention, Signal::building,
                              Signal::done, Signal::fault, Signal::off}) {
    ASSERT_TRUE(lamp.show(signal));
    EXPECT_EQ(world().panel(), panel_at(signal, 0ms)) << static_cast<int>(signal);
  }
}

TEST_P(PanelContract, LightsGoOnAndOff) {
  auto& lights = *world().hardware().lights;
  EXPECT_FALSE(world().lights_on());
  ASSERT_TRUE(lights.set(true));
  EXPECT_TRUE(world().lights_on());
  ASSERT_TRUE(lights.set(false));
  EXPECT_FALSE(world().lights_on());
}

TEST_P(PanelContract, EverythingIsDarkAfterwards) {
  auto& hardware = world().hardware();
  ASSERT_TRUE(hardware.lamp->show(Signal::fault));
  ASSERT_TRUE(hardware.lights->set(true));
  hardware = {};
  EXPECT_EQ(world().panel(), PanelState{});
  EXPECT_FALSE(world().lights_on());
  EXPECT_FALSE(world().current_on());
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PanelContract);

}  // namespace skullstation::contract
