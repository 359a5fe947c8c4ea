// The libcamera backend on the kernel's virtual media controller, vimc (`run --libcamera`): what
// the contract of all cameras leaves open.

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
