// What can be tested without a CSI camera: the same calls in a build with libcamera and without.
#include "capture/cameras/libcamera_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skullstation {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

TEST(LibcameraCamera, ACameraThatIsNotThereIsAClearError) {
  const auto camera = open_libcamera_camera({.id = "/base/no/such/camera"});
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().kind, ErrorKind::hardware);
  EXPECT_THAT(camera.error().message(),
              AnyOf(HasSubstr("no camera found"), HasSubstr("there is no camera"),
                    HasSubstr("this build has no libcamera")));
}

TEST(LibcameraCamera, ListingIsTheSameEveryTime) {
  const auto first = list_libcamera_cameras();
  const auto second = list_libcamera_cameras();
  ASSERT_EQ(first.has_value(), second.has_value());
  if (first) {
    EXPECT_EQ(first->size(), second->size());
  } else {
    EXPECT_THAT(first.error().message(), HasSubstr("this build has no libcamera"));
  }
}

TEST(LibcameraCamera, ConfigurationsThatMakeNoSenseAreNamed) {
  EXPECT_TRUE(LibcameraConfig{}.validate());
  EXPECT_EQ(open_libcamera_camera({.buffers = 1}).error().where, "buffers");
  EXPECT_EQ((LibcameraConfig{.size = FrameSize{0, 1}}.validate().error().where), "size");
  EXPECT_EQ((LibcameraConfig{.settle_frames = -1}.validate().error().where), "settle_frames");
}

}  // namespace
}  // namespace skullstation
