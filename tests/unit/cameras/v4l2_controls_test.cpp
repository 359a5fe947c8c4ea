#include "capture/cameras/v4l2_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "capture/cameras/camera_settings.h"
#include "tests/unit/cameras/scripted_v4l2.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScriptedCamera;
using testing::ScriptedControl;
using testing::ScriptedV4l2;
using testing::webcam;

class V4l2Controls : public ::testing::Test {
 protected:
  V4l2Controls() : system_(std::make_shared<ScriptedV4l2>()), camera_(webcam()) {
    auto device = V4l2Device::open(system_, system_->plug_in(camera_, 0));
    EXPECT_TRUE(device);
    device_ = std::make_unique<V4l2Device>(std::move(*device));
  }

  ScriptedControl& control(std::uint32_t id) {
    return *std::find_if(camera_->controls.begin(), camera_->controls.end(),
                         [id](const ScriptedControl& candidate) { return candidate.id == id; });
  }
  void remove(std::uint32_t id) {
    std::erase_if(camera_->controls,
                  [id](const ScriptedControl& candidate) { return candidate.id == id; });
  }

  std::vector<LockedSetting> locked(const CameraSettings& settings,
                                    std::optional<double> gain_steps = {}) {
    auto result = lock_v4l2_controls(*device_, settings, gain_steps);
    if (!result) {
      ADD_FAILURE() << result.error().message();
      return {};
    }
    return *result;
  }
  Error error(const CameraSettings& settings) {
    const auto result = lock_v4l2_controls(*device_, settings, {});
    EXPECT_FALSE(result);
    return result ? Error{} : result.error();
  }

  std::shared_ptr<ScriptedV4l2> system_;
  std::shared_ptr<ScriptedCamera> camera_;
  std::unique_ptr<V4l2Device> device_;
};

MATCHER_P3(Setting, name, asked, in_force, "") {
  return arg.control == name && arg.asked == asked && arg.in_force == in_force;
}

TEST_F(V4l2Controls, AreListedUnderTheirPlainNames) {
  const auto controls = list_v4l2_controls(*device_);
  ASSERT_TRUE(controls);
  ASSERT_EQ(controls->size(), 8U);
  const CameraControl& exposure = (*controls)[5];
  EXPECT_EQ(exposure.name, "exposure_time_absolute");
  EXPECT_EQ(exposure.minimum, 3);
  EXPECT_EQ(exposure.maximum, 2047);
  EXPECT_EQ(exposure.value, 250);
  EXPECT_FALSE(exposure.read_only);
}

TEST_F(V4l2Controls, WhatIsNoReadableNumberIsLeftOut) {
  camera_->controls = {
      {1, "Class", V4L2_CTRL_TYPE_CTRL_CLASS, 0, 0, 1, 0, V4L2_CTRL_FLAG_READ_ONLY},
      {2, "Button", V4L2_CTRL_TYPE_BUTTON, 0, 0, 0, 0, V4L2_CTRL_FLAG_WRITE_ONLY},
      {3, "Name", V4L2_CTRL_TYPE_STRING, 0, 20, 1, 0},
      {4, "Region", V4L2_CTRL_TYPE_AREA, 0, 0, 1, 0},
      {5, "Off", V4L2_CTRL_TYPE_INTEGER, 0, 9, 1, 0, V4L2_CTRL_FLAG_DISABLED},
      {.id = 6, .name = "Broken", .maximum = 9, .get_error = EIO},
      {7, "Pixel Rate", V4L2_CTRL_TYPE_INTEGER64, 0, 1LL << 40, 1, 1LL << 39,
       V4L2_CTRL_FLAG_READ_ONLY},
  };
  const auto controls = list_v4l2_controls(*device_);
  ASSERT_TRUE(controls);
  ASSERT_EQ(controls->size(), 1U);
  EXPECT_EQ(controls->front().name, "pixel_rate");
  EXPECT_EQ(controls->front().value, 1LL << 39);
  EXPECT_TRUE(controls->front().read_only);
}

TEST_F(V4l2Controls, ABitMaskIsNeverNegative) {
  camera_->controls = {{8, "Mask", V4L2_CTRL_TYPE_BITMASK, 0, 0x80402010, 0, 0x80002000}};
  const auto controls = list_v4l2_controls(*device_);
  ASSERT_TRUE(controls);
  ASSERT_EQ(controls->size(), 1U);
  EXPECT_EQ(controls->front().value, 0x80002000);
}

TEST_F(V4l2Controls, ListingAnUnpluggedCameraIsAnError) {
  system_->unplug(0);
  const auto controls = list_v4l2_controls(*device_);
  ASSERT_FALSE(controls);
  EXPECT_THAT(controls.error().message(), HasSubstr("unplugged"));
}

TEST(ControlName, PunctuationAndCaseAreEvenedOut) {
  EXPECT_EQ(control_name("White Balance, Automatic"), "white_balance_automatic");
  EXPECT_EQ(control_name("Exposure (Absolute)"), "exposure_absolute");
  EXPECT_EQ(control_name("  H.264 "), "h_264");
}

TEST_F(V4l2Controls, NothingAskedNothingTouched) {
  const auto before = camera_->controls.size();
  EXPECT_TRUE(locked({}).empty());
  EXPECT_EQ(camera_->controls.size(), before);
  EXPECT_EQ(std::count(system_->calls.begin(), system_->calls.end(), VIDIOC_S_EXT_CTRLS), 0);
}

TEST_F(V4l2Controls, EverythingIsLockedAutomaticsFirst) {
  EXPECT_THAT(
      locked({.exposure = 8000us, .gain = 1.0, .white_balance_k = 5000, .focus = 0.5}),
      ::testing::ElementsAre(
          Setting("auto_exposure", 1, 1), Setting("exposure_time_absolute", 80, 80),
          Setting("gain", 16, 16), Setting("white_balance_automatic", 0, 0),
          Setting("white_balance_temperature", 5000, 5000),
          Setting("focus_automatic_continuous", 0, 0), Setting("focus_absolute", 125, 125)));
}

TEST_F(V4l2Controls, ExposureIsRoundedToItsUnitOf100us) {
  EXPECT_THAT(locked({.exposure = 8049us}).back(), Setting("exposure_time_absolute", 80, 80));
  EXPECT_THAT(locked({.exposure = 8050us}).back(), Setting("exposure_time_absolute", 81, 81));
}

TEST_F(V4l2Controls, TheValueInForceIsReadBack) {
  EXPECT_THAT(locked({.white_balance_k = 5006}).back(),
              Setting("white_balance_temperature", 5006, 5000));
}

TEST_F(V4l2Controls, FocusRunsFromFarToNear) {
  EXPECT_THAT(locked({.focus = 0.0}).back(), Setting("focus_absolute", 0, 0));
  EXPECT_THAT(locked({.focus = 1.0}).back(), Setting("focus_absolute", 250, 250));
  EXPECT_THAT(locked({.focus = 0.331}).back(), Setting("focus_absolute", 85, 85));
}

TEST_F(V4l2Controls, AGainAboveOneNeedsAUnit) {
  const Error told = error({.gain = 2.0});
  EXPECT_EQ(told.kind, ErrorKind::bad_input);
  EXPECT_THAT(told.message(), AllOf(HasSubstr("control gain"), HasSubstr("gain_steps_per_unit")));
  EXPECT_THAT(locked({.gain = 2.5}, 32.0).back(), Setting("gain", 64, 64));
}

TEST_F(V4l2Controls, AutomaticGainIsSwitchedOff) {
  camera_->controls.insert(camera_->controls.begin() + 2, {V4L2_CID_AUTOGAIN, "Gain, Automatic",
                                                           V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1, 1});
  EXPECT_THAT(locked({.gain = 1.0}).front(), Setting("gain_automatic", 0, 0));
  EXPECT_EQ(control(V4L2_CID_AUTOGAIN).value, 0);
}

TEST_F(V4l2Controls, ShutterPriorityWillDoWhereManualIsMissing) {
  control(V4L2_CID_EXPOSURE_AUTO).menu = {0, 2};
  EXPECT_THAT(locked({.exposure = 8000us}).front(), Setting("auto_exposure", 2, 2));
}

TEST_F(V4l2Controls, ACameraThatOnlyExposesAutomaticallyIsAnError) {
  control(V4L2_CID_EXPOSURE_AUTO).menu = {0, 3};
  const Error told = error({.exposure = 8000us});
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_THAT(told.message(), HasSubstr("no manual exposure"));
}

TEST_F(V4l2Controls, ACameraWithoutTheAutomaticIsJustSet) {
  remove(V4L2_CID_EXPOSURE_AUTO);
  EXPECT_THAT(locked({.exposure = 8000us}),
              ::testing::ElementsAre(Setting("exposure_time_absolute", 80, 80)));
}

TEST_F(V4l2Controls, AnAutomaticThatStaysOnIsAnError) {
  control(V4L2_CID_EXPOSURE_AUTO).stuck = true;
  EXPECT_THAT(error({.exposure = 8000us}).message(), HasSubstr("automatic exposure stays on"));
  control(V4L2_CID_AUTO_WHITE_BALANCE).stuck = true;
  EXPECT_THAT(error({.white_balance_k = 5000}).message(),
              AllOf(HasSubstr("white_balance_automatic"), HasSubstr("could not be switched off")));
}

TEST_F(V4l2Controls, ASettingThatTheDeviceHasNotIsNamed) {
  const std::vector<std::tuple<std::uint32_t, CameraSettings, const char*>> cases{
      {V4L2_CID_EXPOSURE_ABSOLUTE, {.exposure = 8000us}, "exposure"},
      {V4L2_CID_GAIN, {.gain = 1.0}, "gain"},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {.white_balance_k = 5000}, "white_balance_k"},
      {V4L2_CID_FOCUS_ABSOLUTE, {.focus = 0.5}, "focus"}};
  for (const auto& [id, settings, name] : cases) {
    remove(id);
    const Error told = error(settings);
    EXPECT_EQ(told.kind, ErrorKind::bad_input);
    EXPECT_THAT(told.message(), AllOf(HasSubstr("Scripted Camera"),
                                      HasSubstr(std::string("no control for ") + name)));
  }
}

TEST_F(V4l2Controls, AValueOutsideTheRangeIsAnErrorThatTellsTheRange) {
  const Error told = error({.exposure = 1s});
  EXPECT_EQ(told.kind, ErrorKind::bad_input);
  EXPECT_THAT(told.message(), AllOf(HasSubstr("exposure_time_absolute"), HasSubstr("1000000 us"),
                                    HasSubstr("3..2047")));
  EXPECT_FALSE(lock_v4l2_controls(*device_, {.white_balance_k = 900}, {}));
}

TEST_F(V4l2Controls, ADeviceThatRefusesIsAnErrorThatNamesTheControl) {
  control(V4L2_CID_GAIN).set_error = EBUSY;
  const Error told = error({.gain = 1.0});
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_THAT(told.message(), HasSubstr("control gain"));
  control(V4L2_CID_GAIN).set_error = 0;
  control(V4L2_CID_GAIN).get_error = EIO;
  EXPECT_THAT(error({.gain = 1.0}).message(), HasSubstr("reading it back"));
  control(V4L2_CID_GAIN).flags = V4L2_CTRL_FLAG_READ_ONLY;
  EXPECT_THAT(error({.gain = 1.0}).message(), HasSubstr("can only be read"));
}

TEST_F(V4l2Controls, ManualExposureIsKnownOnlyWhenItIsManual) {
  EXPECT_FALSE(manual_exposure(*device_));
  locked({.exposure = 8000us});
  EXPECT_EQ(manual_exposure(*device_), 8000us);
  remove(V4L2_CID_EXPOSURE_ABSOLUTE);
  EXPECT_FALSE(manual_exposure(*device_));
}

TEST(CheckSettings, WhatNoCameraCanMeanIsRefusedByName) {
  const auto refused = [](const CameraSettings& settings) {
    const auto sensible = check_settings(settings);
    return sensible ? std::string("accepted") : sensible.error().where;
  };
  EXPECT_EQ(refused({}), "accepted");
  EXPECT_EQ(refused({.exposure = 1us, .gain = 1.0, .white_balance_k = 1, .focus = 1.0}),
            "accepted");
  EXPECT_EQ(refused({.exposure = 0us}), "exposure");
  EXPECT_EQ(refused({.gain = 0.5}), "gain");
  EXPECT_EQ(refused({.gain = std::nan("")}), "gain");
  EXPECT_EQ(refused({.white_balance_k = 0}), "white_balance_k");
  EXPECT_EQ(refused({.focus = 1.1}), "focus");
}

TEST(Overlaid, OnlyWhatChangesIsReplaced) {
  const CameraSettings both = overlaid({.exposure = 1us, .gain = 2.0}, {.gain = 3.0, .focus = 0.5});
  EXPECT_EQ(both.exposure, 1us);
  EXPECT_EQ(both.gain, 3.0);
  EXPECT_EQ(both.focus, 0.5);
  EXPECT_FALSE(both.white_balance_k);
}

}  // namespace
}  // namespace skullstation
