// The libcamera backend on the kernel's virtual media controller, vimc (`run --libcamera`).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/cameras/libcamera_camera.h"
#include "core/clock.h"

namespace skullstation {
namespace {

using testing::HasSubstr;

constexpr std::chrono::milliseconds patience{60'000};

class LibcameraLab : public testing::Test {
 protected:
  // vimc's scaler works in steps of 6 pixels.
  LibcameraLab() { config_.size = FrameSize{636, 480}; }

  std::unique_ptr<Camera> opened() {
    auto camera = open_libcamera_camera(config_);
    if (!camera) throw std::runtime_error(camera.error().message());
    return std::move(*camera);
  }

  SystemClock clock_;
  LibcameraConfig config_;
};

TEST_F(LibcameraLab, FindsTheCamera) {
  const auto cameras = list_libcamera_cameras();
  ASSERT_TRUE(cameras) << cameras.error().message();
  ASSERT_EQ(cameras->size(), 1u);
  EXPECT_EQ(cameras->front().id, "platform/vimc.0 Sensor B");
}

TEST_F(LibcameraLab, FramesAreFreshAndInOrder) {
  const auto camera = opened();
  EXPECT_EQ(camera->description().backend, "libcamera");
  EXPECT_EQ(camera->description().stable_path, "platform/vimc.0 Sensor B");
  std::uint32_t last = 0;
  for (int i = 0; i < 3; ++i) {
    const Instant asked = clock_.now();
    const auto frame = camera->frame_after(asked, patience, {});
    ASSERT_TRUE(frame) << frame.error().message();
    EXPECT_EQ(frame->image.width, 636);
    EXPECT_EQ(frame->image.height, 480);
    EXPECT_EQ(frame->image.channels, 3);
    EXPECT_GE(frame->exposure_start, asked);
    EXPECT_LE(frame->exposure_start, clock_.now());
    EXPECT_GT(frame->sequence, last);
    last = frame->sequence;
  }
}

TEST_F(LibcameraLab, ASettingThatItLacksIsNamed) {
  const auto camera = opened();
  CameraSettings settings;
  settings.exposure = std::chrono::milliseconds(8);
  const auto locked = camera->lock(settings);
  ASSERT_FALSE(locked);
  EXPECT_EQ(locked.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(locked.error().message(), HasSubstr("exposure"));
  const auto frame = camera->frame_after(clock_.now(), patience, {});
  EXPECT_TRUE(frame) << frame.error().message();  // the stream goes on
}

TEST_F(LibcameraLab, Reopens) {
  const auto camera = opened();
  ASSERT_TRUE(camera->frame_after(clock_.now(), patience, {}));
  const auto reopened = camera->reopen();
  ASSERT_TRUE(reopened) << reopened.error().message();
  const auto frame = camera->frame_after(clock_.now(), patience, {});
  EXPECT_TRUE(frame) << frame.error().message();
}

TEST_F(LibcameraLab, ASecondUserIsToldThatItIsBusy) {
  const auto camera = opened();
  const auto second = open_libcamera_camera(config_);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::hardware);
  std::cout << "second user: " << second.error().message() << "\n";
}

TEST_F(LibcameraLab, ASizeThatItChangesIsAnErrorUnlessAllowed) {
  config_.size = FrameSize{640, 480};
  const auto refused = open_libcamera_camera(config_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::hardware);
  EXPECT_THAT(refused.error().message(), HasSubstr("640x480"));
  EXPECT_THAT(refused.error().message(), HasSubstr("636x480"));
  config_.allow_other_size = true;
  EXPECT_THAT(opened()->description().format, HasSubstr("636x480"));
}

TEST_F(LibcameraLab, ACameraThatIsNotThereIsRefused) {
  config_.id = "imx477 on the other connector";
  const auto refused = open_libcamera_camera(config_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::hardware);
  EXPECT_THAT(refused.error().message(), HasSubstr(config_.id));
  EXPECT_THAT(refused.error().message(), HasSubstr("vimc"));
}

}  // namespace
}  // namespace skullstation
