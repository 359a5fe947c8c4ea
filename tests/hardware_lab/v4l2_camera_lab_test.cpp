// The V4L2 backend against the kernel's own virtual camera, vivid: what the contract of all cameras
// leaves open.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "capture/cameras/v4l2_camera.h"
#include "core/clock.h"
#include "tests/hardware_lab/kernel_trace.h"
#include "tests/hardware_lab/vivid_device.h"

namespace skullstation {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

// Generous: under emulation on a busy machine a frame may take its time.
constexpr milliseconds patience{60'000};

class V4l2CameraLab : public testing::Test {
 protected:
  V4l2CameraLab() {
    config_.device = VividDevice::stable_path();
    config_.format.size = FrameSize{640, 360};
    config_.format.format = "YUYV";
    config_.format.frames_per_second = 30.0;
    vivid_.show_colour_bars();
  }

  std::unique_ptr<Camera> opened() {
    auto camera = open_v4l2_camera(config_);
    if (!camera) throw std::runtime_error(camera.error().message());
    return std::move(*camera);
  }

  Result<Frame> fresh_frame(Camera& camera) {
    return camera.frame_after(clock_.now(), patience, {});
  }

  std::int64_t value_of(Camera& camera, const std::string& name) {
    const auto controls = camera.controls();
    for (const CameraControl& control : controls.value()) {
      if (control.name == name) return control.value;
    }
    throw std::out_of_range("no control " + name);
  }

  SystemClock clock_;
  VividDevice vivid_;
  V4l2CameraConfig config_;
};

TEST_F(V4l2CameraLab, IsListedWithItsStablePathAndFormats) {
  const std::vector<V4l2CameraInfo> cameras = list_v4l2_cameras();
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].node, VividDevice::node());
  EXPECT_EQ(cameras[0].stable_path, VividDevice::stable_path());
  EXPECT_EQ(cameras[0].driver, "vivid");
  EXPECT_EQ(cameras[0].problem, "");
  EXPECT_THAT(to_string(cameras[0].formats), HasSubstr("NV12 320x180 640x360"));
}

TEST_F(V4l2CameraLab, GainIsLockedReadBackAndKeptByReopening) {
  const auto camera = opened();
  EXPECT_EQ(value_of(*camera, "gain_automatic"), 1);
  CameraSettings only_gain;
  only_gain.gain = 1.0;
  const auto locked = camera->lock(only_gain);
  ASSERT_TRUE(locked) << locked.error().message();
  const auto has = [&](const std::string& control, std::int64_t value) {
    return std::any_of(locked->begin(), locked->end(), [&](const LockedSetting& setting) {
      return setting.control == control && setting.asked == value && setting.in_force == value;
    });
  };
  EXPECT_TRUE(has("gain_automatic", 0));
  EXPECT_TRUE(has("gain", 0));

  vivid_.unplug();
  vivid_.plug();  // with its defaults, as a real one
  const auto reopened = camera->reopen();
  ASSERT_TRUE(reopened) << reopened.error().message();
  EXPECT_EQ(value_of(*camera, "gain_automatic"), 0);
  EXPECT_EQ(value_of(*camera, "gain"), 0);
}

TEST_F(V4l2CameraLab, DamagedBuffersNeverReachTheCaller) {
  const auto camera = opened();
  ASSERT_TRUE(fresh_frame(*camera));
  const KernelTrace trace("v4l2/v4l2_dqbuf");
  std::vector<std::uint32_t> delivered;
  for (int i = 0; i < 3; ++i) {
    vivid_.damage_next_buffer();
    for (int k = 0; k < 4; ++k) {
      const auto frame = fresh_frame(*camera);
      ASSERT_TRUE(frame) << frame.error().message();
      delivered.push_back(frame->sequence);
    }
  }
  const std::vector<std::uint32_t> damaged = damaged_buffers(trace.events());
  EXPECT_EQ(damaged.size(), 3u);
  for (const std::uint32_t sequence : damaged) {
    EXPECT_THAT(delivered, testing::Not(testing::Contains(sequence)));
  }
}

TEST_F(V4l2CameraLab, AStalledCameraTimesOutAndRecoversInTheStream) {
  const auto camera = opened();
  ASSERT_TRUE(fresh_frame(*camera));
  vivid_.drop_frames(100);
  const auto nothing = camera->frame_after(clock_.now(), milliseconds(700), {});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().kind, ErrorKind::hardware);
  EXPECT_THAT(nothing.error().message(), HasSubstr("700"));
  vivid_.drop_frames(0);
  const auto frame = fresh_frame(*camera);
  EXPECT_TRUE(frame) << frame.error().message();
}

TEST_F(V4l2CameraLab, ABrokenStreamIsAnErrorUntilItIsReopened) {
  const auto camera = opened();
  ASSERT_TRUE(fresh_frame(*camera));
  vivid_.break_stream();
  const auto broken = fresh_frame(*camera);
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().kind, ErrorKind::hardware);
  std::cout << "broken stream: " << broken.error().message() << "\n";

  const auto reopened = camera->reopen();
  ASSERT_TRUE(reopened) << reopened.error().message();
  const auto frame = fresh_frame(*camera);
  EXPECT_TRUE(frame) << frame.error().message();
}

TEST_F(V4l2CameraLab, AStreamThatDoesNotStartIsAnErrorAndTheNextTryWorks) {
  const auto camera = opened();
  vivid_.refuse_next_stream_start();
  const auto refused = camera->reopen();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::hardware);
  const auto closed = fresh_frame(*camera);
  ASSERT_FALSE(closed);
  EXPECT_EQ(closed.error().kind, ErrorKind::hardware);
  ASSERT_TRUE(camera->reopen());
  EXPECT_TRUE(fresh_frame(*camera));
}

TEST_F(V4l2CameraLab, ASecondUserIsToldThatItIsBusy) {
  const auto camera = opened();
  const auto second = open_v4l2_camera(config_);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::hardware);
  EXPECT_THAT(second.error().message(), HasSubstr("another program"));
  EXPECT_TRUE(fresh_frame(*camera));  // the first is not disturbed
}

TEST_F(V4l2CameraLab, ASizeThatTheDriverChangesIsAnErrorUnlessAllowed) {
  config_.format.size = FrameSize{1000, 700};
  const auto refused = open_v4l2_camera(config_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::hardware);
  EXPECT_THAT(refused.error().message(), HasSubstr("1000x700"));
  EXPECT_THAT(refused.error().message(), HasSubstr("1280x720"));

  config_.format.allow_other_size = true;
  const auto camera = opened();
  EXPECT_THAT(camera->description().format, HasSubstr("1280x720"));
  const auto frame = fresh_frame(*camera);
  ASSERT_TRUE(frame) << frame.error().message();
  EXPECT_EQ(frame->image.width, 1280);
  EXPECT_EQ(frame->image.height, 720);
}

TEST_F(V4l2CameraLab, AFormatThatItLacksIsRefusedWithWhatItOffers) {
  config_.format.format = "MJPG";
  const auto refused = open_v4l2_camera(config_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(refused.error().message(), HasSubstr("YUYV"));
}

TEST_F(V4l2CameraLab, WhatIsNoCameraIsRefused) {
  for (const char* device : {"/dev/null", "/dev/video63", "/dev/v4l/by-path/nothing"}) {
    config_.device = device;
    const auto refused = open_v4l2_camera(config_);
    ASSERT_FALSE(refused) << device;
    EXPECT_EQ(refused.error().kind, ErrorKind::hardware);
    EXPECT_THAT(refused.error().message(), HasSubstr(device));
  }
}

TEST_F(V4l2CameraLab, UnpluggedWhileStreamingItIsAnErrorAndComesBackByItsStablePath) {
  config_.device = VividDevice::node();  // what a beginner writes
  const auto camera = opened();
  EXPECT_EQ(camera->description().stable_path, VividDevice::stable_path());
  ASSERT_TRUE(fresh_frame(*camera));

  vivid_.drop_frames(100);  // so that the camera waits, whatever comes first
  Instant pulled;
  std::jthread hand([&] {
    pulled = clock_.now();
    vivid_.unplug();
  });
  const auto gone = camera->frame_after(clock_.now(), std::chrono::hours(1), {});
  const Instant noticed = clock_.now();
  hand.join();
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, ErrorKind::hardware);
  EXPECT_THAT(gone.error().message(), HasSubstr("unplugged"));
  std::cout << "unplugged: noticed after "
            << std::chrono::duration<double, std::milli>(noticed - pulled).count()
            << " ms: " << gone.error().message() << "\n";

  const auto missing = camera->reopen();
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::hardware);
  EXPECT_THAT(missing.error().message(), HasSubstr(VividDevice::stable_path()));

  vivid_.plug();
  const auto back = camera->reopen();
  ASSERT_TRUE(back) << back.error().message();
  const auto frame = fresh_frame(*camera);
  EXPECT_TRUE(frame) << frame.error().message();
}

// Colours of the 75 % bars (SMPTE): R, G and B are on or off, at 0.75 of 255.
constexpr int bar_level = 191;
constexpr int bars[8][3] = {{1, 1, 1}, {1, 1, 0}, {0, 1, 1}, {0, 1, 0},
                            {1, 0, 1}, {1, 0, 0}, {0, 0, 1}, {0, 0, 0}};

class V4l2FormatLab : public testing::TestWithParam<const char*> {
 protected:
  // One device for all formats: opening it sets everything that they need.
  static void SetUpTestSuite() { VividDevice().show_colour_bars(); }

  SystemClock clock_;
};

TEST_P(V4l2FormatLab, ColourBarsComeOutRight) {
  V4l2CameraConfig config;
  config.device = VividDevice::stable_path();
  config.format.size = FrameSize{640, 360};
  config.format.format = GetParam();
  config.format.frames_per_second = 30.0;
  config.settle_frames = 0;
  const auto camera = open_v4l2_camera(config);
  ASSERT_TRUE(camera) << camera.error().message();
  EXPECT_THAT((*camera)->description().format, HasSubstr("640x360"));
  const auto frame = (*camera)->frame_after(clock_.now(), patience, {});
  ASSERT_TRUE(frame) << frame.error().message();
  ASSERT_EQ(frame->image.width, 640);
  ASSERT_EQ(frame->image.height, 360);
  for (int bar = 0; bar < 8; ++bar) {
    const int* on = bars[bar];
    for (int channel = 0; channel < frame->image.channels; ++channel) {
      // vivid's grey is the luma of ITU-R BT.709.
      const double expected = frame->image.channels == 3
                                  ? bar_level * on[channel]
                                  : bar_level * (0.2126 * on[0] + 0.7152 * on[1] + 0.0722 * on[2]);
      EXPECT_NEAR(frame->image.at(80 * bar + 40, 180, channel), expected, 3)
          << "bar " << bar << " channel " << channel;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Vivid, V4l2FormatLab,
                         testing::Values("YUYV", "UYVY", "NV12", "NV21", "RGB3", "BGR3", "GREY",
                                         "Y10", "Y12", "Y16", "RGGB", "GRBG", "GBRG", "BA81",
                                         "RG10", "BG12", "RG16"),
                         [](const auto& format) { return std::string(format.param); });

}  // namespace
}  // namespace skullstation
