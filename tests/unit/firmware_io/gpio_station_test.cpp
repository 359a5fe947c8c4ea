#include "firmware_io/gpio_station.h"

#include <gmock/gmock.h>

#include <cerrno>
#include <thread>

#include "tests/contract/fake_gpio.h"

namespace skullstation {
namespace {

using contract::FakeGpio;
using testing::HasSubstr;
using namespace std::chrono_literals;

FakeGpio::Levels all_lines() {
  return {{"turntable-step", false}, {"turntable-dir", false}, {"turntable-enable", true},
          {"turntable-home", true},  {"estop", false},         {"start-button", true},
          {"lamp-green", false},     {"lamp-yellow", false},   {"lamp-red", false},
          {"buzzer", false},         {"lights", false}};
}

class GpioStationTest : public testing::Test {
 protected:
  Result<StationHardware> open() {
    return open_gpio_station(config_, turntable_, clock_, GpioLines(FakeGpio::chips(chips_)));
  }

  std::string message() {
    const auto station = open();
    return station ? "opened" : station.error().message();
  }

  SystemClock clock_;
  GpioStationConfig config_;
  TurntableConfig turntable_;
  std::shared_ptr<FakeGpio> gpio_ = std::make_shared<FakeGpio>("gpiochip0", all_lines());
  std::vector<std::shared_ptr<FakeGpio>> chips_{gpio_};
};

TEST_F(GpioStationTest, OpensWithEverythingOff) {
  const auto station = open();
  ASSERT_TRUE(station) << station.error().message();
  EXPECT_TRUE(gpio_->high("turntable-enable")) << "active low: no current";
  for (const char* line : {"lamp-green", "lamp-yellow", "lamp-red", "buzzer", "lights"}) {
    EXPECT_FALSE(gpio_->high(line)) << line;
  }
  EXPECT_FALSE(station->interlock->tripped());
}

TEST_F(GpioStationTest, LinesMayBeOnSeveralChips) {
  auto lines = all_lines();
  lines.erase("estop");
  chips_ = {std::make_shared<FakeGpio>("gpiochip0", lines),
            std::make_shared<FakeGpio>("gpiochip1", FakeGpio::Levels{{"estop", false}})};
  EXPECT_EQ(message(), "opened");
}

TEST_F(GpioStationTest, StopThatIsPressedAlreadyHasTripped) {
  gpio_->pull("estop", true);
  const auto station = open();
  ASSERT_TRUE(station);
  EXPECT_TRUE(station->interlock->tripped());
  EXPECT_EQ(station->interlock->reason(), "emergency stop pressed");
  EXPECT_FALSE(station->interlock->reset());
  gpio_->pull("estop", false);
  EXPECT_TRUE(station->interlock->reset());
}

TEST_F(GpioStationTest, NamesTheLineThatIsMissing) {
  config_.button.name = "sart-button";
  EXPECT_THAT(message(), HasSubstr("GPIO line \"sart-button\": not found on gpiochip0 [fake]; "
                                   "`gpioinfo` lists the lines"));
}

TEST_F(GpioStationTest, NamesTheLineThatIsInUseAndWhoHasIt) {
  gpio_->occupy("lights", "led-driver");
  EXPECT_THAT(message(), HasSubstr("GPIO line \"lights\": is in use by \"led-driver\""));
}

TEST_F(GpioStationTest, NamesTheLineThatIsOnTwoChips) {
  chips_.push_back(std::make_shared<FakeGpio>("gpiochip1", FakeGpio::Levels{{"estop", false}}));
  EXPECT_THAT(message(), HasSubstr("GPIO line \"estop\": is on gpiochip0 [fake] and on gpiochip1 "
                                   "[fake]; choose one of them by gpio.chip"));
}

TEST_F(GpioStationTest, SaysWhyALineCannotBeRequested) {
  gpio_->refuse("estop", ENXIO);
  EXPECT_THAT(message(), HasSubstr("GPIO line \"estop\": has no interrupt"));
  gpio_->refuse("estop", EPERM);
  EXPECT_THAT(message(), HasSubstr("GPIO line \"estop\": can't be requested (Operation not"));
}

TEST_F(GpioStationTest, ReleasesEveryLineWhenOneFails) {
  gpio_->refuse("lights", EPERM);
  ASSERT_FALSE(open());
  gpio_->refuse("lights", 0);
  EXPECT_EQ(message(), "opened");
  EXPECT_EQ(message(), "opened") << "again, after the first was closed";
}

TEST_F(GpioStationTest, WhatIsNotFittedIsNotMissed) {
  for (auto* wire :
       {&config_.green, &config_.yellow, &config_.red, &config_.buzzer, &config_.lights}) {
    wire->name.clear();
  }
  auto station = open();
  ASSERT_TRUE(station);
  EXPECT_TRUE(station->lamp->show(Signal::fault));
  EXPECT_TRUE(station->lights->set(true));
}

TEST_F(GpioStationTest, ValidatesWithTheKeyThatIsWrong) {
  config_.step.name.clear();
  EXPECT_THAT(message(), HasSubstr("gpio.step.line: is empty; this line must be fitted"));
  config_ = {};
  config_.lights.name = "estop";
  EXPECT_THAT(message(), HasSubstr("gpio.lights.line: \"estop\" is the name of another line too"));
  config_ = {};
  config_.step_pulse = 1us;
  EXPECT_THAT(message(), HasSubstr("gpio.step_pulse_us: is 1; 2 to 200 was expected"));
  config_ = {};
  config_.button_timing.debounce = 500ms;
  EXPECT_THAT(message(), HasSubstr("gpio.debounce_ms: is 500"));
  config_ = {};
  turntable_.backlash_deg = 90;
  EXPECT_THAT(message(), HasSubstr("turntable.backlash_deg: is 90"));
}

TEST_F(GpioStationTest, UnpluggingEndsAWaitForTheButton) {
  auto station = open();
  ASSERT_TRUE(station);
  std::jthread hand([&] { gpio_->remove(); });
  const auto press = station->button->wait_for_press(1h, {});
  ASSERT_FALSE(press);
  EXPECT_THAT(press.error().message(), HasSubstr("GPIO chip is gone"));
}

TEST(GpioLines, OpeningWhatIsNotThereNamesIt) {
  const auto lines = GpioLines::open("no-such-chip");
  ASSERT_FALSE(lines);
  EXPECT_EQ(lines.error().kind, ErrorKind::hardware);
  EXPECT_FALSE(lines.error().advice.empty());
}

}  // namespace
}  // namespace skullstation
