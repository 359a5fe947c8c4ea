// The tests themselves; who takes part is decided where CameraContract is instantiated.
#include "tests/contract/camera_contract.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>
#include <thread>

namespace skullstation::contract {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

Frame CameraContract::fresh_frame() {
  Result<Frame> frame = camera().frame_after(world().now(), world().patience(), {});
  if (!frame) throw std::runtime_error(frame.error().message());
  return std::move(*frame);
}

void CameraContract::expect_in_force(const std::vector<LockedSetting>& locked) {
  const auto controls = camera().controls();
  ASSERT_TRUE(controls) << controls.error().message();
  for (const LockedSetting& setting : locked) {
    const auto control = std::find_if(
        controls->begin(), controls->end(),
        [&setting](const CameraControl& listed) { return listed.name == setting.control; });
    ASSERT_NE(control, controls->end()) << setting.control;
    EXPECT_EQ(control->value, setting.in_force) << setting.control;
  }
}

TEST_P(CameraContract, DescribesItself) {
  const CameraDescription described = camera().description();
  EXPECT_FALSE(described.backend.empty());
  EXPECT_FALSE(described.model.empty());
  EXPECT_FALSE(described.stable_path.empty());
  EXPECT_FALSE(described.format.empty());
}

TEST_P(CameraContract, NeverReturnsAnOlderExposureThanAskedFor) {
  for (const auto ahead : {0ms, 0ms, 150ms, 20ms, 0ms, 70ms}) {
    const Instant moment = world().now() + ahead;
    const auto frame = camera().frame_after(moment, world().patience(), {});
    ASSERT_TRUE(frame) << frame.error().message();
    EXPECT_GE(frame->exposure_start, moment);
    EXPECT_LE(frame->exposure_start, world().now());
  }
}

TEST_P(CameraContract, SequenceNumbersIncrease) {
  std::uint32_t last = fresh_frame().sequence;
  for (int i = 0; i < 4; ++i) {
    const std::uint32_t next = fresh_frame().sequence;
    EXPECT_GT(next, last);
    last = next;
  }
}

TEST_P(CameraContract, AllPicturesHaveTheSizeThatIsDescribed) {
  const Frame first = fresh_frame();
  EXPECT_GT(first.image.width, 0);
  EXPECT_GT(first.image.height, 0);
  EXPECT_TRUE(first.image.channels == 1 || first.image.channels == 3);
  EXPECT_THAT(camera().description().format,
              HasSubstr(fmt::format("{}x{}", first.image.width, first.image.height)));
  for (int i = 0; i < 3; ++i) {
    const Frame next = fresh_frame();
    EXPECT_EQ(next.image.width, first.image.width);
    EXPECT_EQ(next.image.height, first.image.height);
    EXPECT_EQ(next.image.channels, first.image.channels);
    EXPECT_EQ(next.image.pixels.size(), first.image.pixels.size());
  }
}

TEST_P(CameraContract, TimesOutAsAHardwareErrorAndGoesOn) {
  const auto late = camera().frame_after(world().now() + 1h, 50ms, {});
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().kind, ErrorKind::hardware);
  EXPECT_FALSE(late.error().where.empty());
  EXPECT_THAT(late.error().what, HasSubstr("50"));
  fresh_frame();
}

TEST_P(CameraContract, AStopRequestCancelsAndTheCameraGoesOn) {
  std::stop_source stop;
  stop.request_stop();
  const auto frame = camera().frame_after(world().now(), world().patience(), stop.get_token());
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
  fresh_frame();
}

TEST_P(CameraContract, AStopRequestEndsAWait) {
  if (!world().real_time()) GTEST_SKIP() << "waiting takes no time here";
  std::stop_source stop;
  const std::jthread operator_thread([&stop] { stop.request_stop(); });
  const auto frame = camera().frame_after(world().now() + 1h, 1h, stop.get_token());
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::cancelled);
}

TEST_P(CameraContract, ControlsAreNamedPlainlyAndLieInTheirRange) {
  fresh_frame();
  const auto controls = camera().controls();
  ASSERT_TRUE(controls) << controls.error().message();
  std::set<std::string> names;
  for (const CameraControl& control : *controls) {
    EXPECT_FALSE(control.name.empty());
    EXPECT_TRUE(std::all_of(control.name.begin(), control.name.end(), [](unsigned char letter) {
      return std::islower(letter) != 0 || std::isdigit(letter) != 0 || letter == '_';
    })) << control.name;
    EXPECT_TRUE(names.insert(control.name).second) << control.name << " is listed twice";
    EXPECT_GE(control.step, 1) << control.name;
    if (control.minimum == control.maximum) continue;  // some drivers know no range
    EXPECT_GE(control.value, control.minimum) << control.name;
    EXPECT_LE(control.value, control.maximum) << control.name;
  }
}

TEST_P(CameraContract, LockingNothingChangesNothing) {
  const auto locked = camera().lock({});
  ASSERT_TRUE(locked) << locked.error().message();
  EXPECT_TRUE(locked->empty());
  fresh_frame();
}

TEST_P(CameraContract, LocksWhatItHasAndReportsWhatIsInForce) {
  const CameraSettings settings = world().lockable();
  const auto locked = camera().lock(settings);
  ASSERT_TRUE(locked) << locked.error().message();
  const auto asked_for = static_cast<std::size_t>(settings.exposure.has_value()) +
                         static_cast<std::size_t>(settings.gain.has_value()) +
                         static_cast<std::size_t>(settings.white_balance_k.has_value()) +
                         static_cast<std::size_t>(settings.focus.has_value());
  EXPECT_GE(locked->size(), asked_for);
  expect_in_force(*locked);
  const Frame frame = fresh_frame();
  if (settings.exposure) {
    ASSERT_TRUE(frame.exposure);
    EXPECT_NEAR(static_cast<double>(frame.exposure->count()),
                static_cast<double>(settings.exposure->count()),
                0.02 * static_cast<double>(settings.exposure->count()));
  }
}

TEST_P(CameraContract, ASettingThatItHasNotIsNamedAndDoesNoHarm) {
  const auto missing = world().missing();
  if (!missing) GTEST_SKIP() << "has every setting";
  const auto locked = camera().lock(missing->settings);
  ASSERT_FALSE(locked);
  EXPECT_EQ(locked.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(locked.error().message(), HasSubstr(missing->name));
  fresh_frame();
}

TEST_P(CameraContract, SettingsThatNoCameraCanMeanAreRefused) {
  for (const CameraSettings& absurd :
       {CameraSettings{.exposure = 0us}, CameraSettings{.gain = 0.0},
        CameraSettings{.white_balance_k = -1}, CameraSettings{.focus = 1.5}}) {
    const auto locked = camera().lock(absurd);
    ASSERT_FALSE(locked);
    EXPECT_EQ(locked.error().kind, ErrorKind::bad_input);
  }
  fresh_frame();
}

TEST_P(CameraContract, ReopensWithTheSettingsLastLocked) {
  const auto locked = camera().lock(world().lockable());
  ASSERT_TRUE(locked) << locked.error().message();
  const Frame before = fresh_frame();
  const CameraDescription described = camera().description();
  const auto reopened = camera().reopen();
  ASSERT_TRUE(reopened) << reopened.error().message();
  const Frame after = fresh_frame();
  EXPECT_EQ(after.exposure, before.exposure);
  EXPECT_EQ(after.image.width, before.image.width);
  EXPECT_EQ(after.image.height, before.image.height);
  EXPECT_EQ(camera().description().stable_path, described.stable_path);
  expect_in_force(*locked);
}

TEST_P(CameraContract, UnpluggedItIsAHardwareErrorUntilItIsBackAndReopened) {
  if (!world().can_unplug()) GTEST_SKIP() << "nothing to unplug";
  const auto locked = camera().lock(world().lockable());
  ASSERT_TRUE(locked) << locked.error().message();
  const Frame before = fresh_frame();

  world().unplug();
  const auto gone = camera().frame_after(world().now(), world().patience(), {});
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, ErrorKind::hardware);
  const auto absent = camera().reopen();
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::hardware);
  EXPECT_FALSE(camera().frame_after(world().now(), 100ms, {}));

  world().plug_in();
  EXPECT_FALSE(camera().frame_after(world().now(), 100ms, {})) << "not before it is reopened";
  const auto back = camera().reopen();
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(fresh_frame().exposure, before.exposure);
  expect_in_force(*locked);
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraContract);

}  // namespace skullstation::contract
