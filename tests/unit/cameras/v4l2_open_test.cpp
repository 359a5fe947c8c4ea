// What can go wrong before the first picture.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>

#include "capture/cameras/v4l2_camera.h"
#include "tests/unit/cameras/scripted_v4l2.h"

namespace skullstation {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::ScriptedCamera;
using testing::ScriptedV4l2;
using testing::webcam;

class V4l2Open : public ::testing::Test {
 protected:
  V4l2Open() : system_(std::make_shared<ScriptedV4l2>()), camera_(webcam()) {
    config_.device = system_->plug_in(camera_, 0);
    config_.format.size = FrameSize{640, 480};
  }

  Result<std::unique_ptr<Camera>> open() { return open_v4l2_camera(config_, system_); }

  /// The error, after which the device must be closed again.
  Error error() {
    const auto opened = open();
    EXPECT_FALSE(opened);
    EXPECT_EQ(system_->open_descriptors(), 0);
    EXPECT_EQ(system_->mapped_buffers(), 0);
    return opened ? Error{} : opened.error();
  }

  void expect_hardware_error(const std::string& words) {
    const Error told = error();
    EXPECT_EQ(told.kind, ErrorKind::hardware) << told.message();
    EXPECT_THAT(told.message(), HasSubstr(words));
  }

  std::shared_ptr<ScriptedV4l2> system_;
  std::shared_ptr<ScriptedCamera> camera_;
  V4l2CameraConfig config_;
};

TEST_F(V4l2Open, StreamsAndReleasesEverythingAtTheEnd) {
  {
    const auto camera = open();
    ASSERT_TRUE(camera) << camera.error().message();
    EXPECT_EQ(system_->open_descriptors(), 1);
    EXPECT_EQ(system_->mapped_buffers(), 4);
  }
  EXPECT_EQ(system_->open_descriptors(), 0);
  EXPECT_EQ(system_->mapped_buffers(), 0);
}

TEST_F(V4l2Open, DescribesTheCamera) {
  camera_->stride_padding = 64;
  const auto camera = open();
  ASSERT_TRUE(camera);
  const CameraDescription described = (*camera)->description();
  EXPECT_EQ(described.backend, "v4l2");
  EXPECT_EQ(described.model, "Scripted Camera");
  EXPECT_EQ(described.serial, "SN1234");
  EXPECT_EQ(described.stable_path, system_->by_id());
  EXPECT_EQ(described.format, "YUYV 640x480 stride 1344 25 fps");
}

TEST_F(V4l2Open, MissingDevice) {
  config_.device = system_->node(7);
  const Error told = error();
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_THAT(told.message(), AllOf(HasSubstr(config_.device), HasSubstr("no such device")));
}

TEST_F(V4l2Open, BusyWhenOpened) {
  camera_->open_error = EBUSY;
  expect_hardware_error("in use by another program");
}

TEST_F(V4l2Open, NoPermission) {
  camera_->open_error = EACCES;
  expect_hardware_error("no permission");
}

TEST_F(V4l2Open, BusyWhenItsFormatIsSet) {
  camera_->errors[VIDIOC_S_FMT] = {EBUSY};
  expect_hardware_error("in use by another program");
}

TEST_F(V4l2Open, BusyWhenBuffersAreReserved) {
  camera_->errors[VIDIOC_REQBUFS] = {EBUSY};
  expect_hardware_error("in use by another program");
}

TEST_F(V4l2Open, StreamCanNotBeStarted) {
  camera_->errors[VIDIOC_STREAMON] = {EIO};
  expect_hardware_error("starting the stream");
}

TEST_F(V4l2Open, NotEnoughUsbBandwidth) {
  camera_->errors[VIDIOC_STREAMON] = {ENOSPC};
  expect_hardware_error("bandwidth");
}

TEST_F(V4l2Open, NotAVideoDevice) {
  camera_->errors[VIDIOC_QUERYCAP] = {ENOTTY};
  expect_hardware_error("not a video device");
}

TEST_F(V4l2Open, UnpluggedWhileOpening) {
  camera_->errors[VIDIOC_QUERYCAP] = {ENODEV};
  expect_hardware_error("unplugged");
}

TEST_F(V4l2Open, MetadataNode) {
  camera_->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  expect_hardware_error("takes no pictures");
}

TEST_F(V4l2Open, MultiPlanarCameraIsSentToLibcamera) {
  camera_->capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  expect_hardware_error("libcamera");
}

TEST_F(V4l2Open, CameraWithoutStreaming) {
  camera_->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  expect_hardware_error("can't stream");
}

TEST_F(V4l2Open, TooFewBuffers) {
  camera_->most_buffers = 1;
  expect_hardware_error("grants 1 buffers");
}

TEST_F(V4l2Open, BuffersThatCanNotBeMapped) {
  camera_->maps = false;
  expect_hardware_error("can't be mapped");
}

TEST_F(V4l2Open, TimestampsOfAnUnknownClock) {
  camera_->timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  expect_hardware_error("monotonic clock");
}

TEST_F(V4l2Open, EveryCallThatFailsLeavesNothingBehind) {
  for (const unsigned long request :
       {VIDIOC_QUERYCAP, VIDIOC_ENUM_FMT, VIDIOC_S_FMT, VIDIOC_REQBUFS, VIDIOC_QUERYBUF,
        VIDIOC_QBUF, VIDIOC_STREAMON}) {
    camera_->errors[request] = {EIO};
    expect_hardware_error("input/output error");
  }
  // The last of several buffers fails.
  camera_->errors[VIDIOC_QUERYBUF] = {0, 0, 0, EIO};
  expect_hardware_error("mapping its buffers");
}

TEST_F(V4l2Open, ConfigurationsThatMakeNoSenseAreNamed) {
  const auto refused = [](const V4l2CameraConfig& config) {
    const auto valid = config.validate();
    return valid ? std::string("accepted") : valid.error().where;
  };
  V4l2CameraConfig config{.device = "/dev/video0"};
  EXPECT_TRUE(config.validate());
  EXPECT_EQ(refused({}), "device");
  EXPECT_EQ(refused({.device = "d", .buffers = 1}), "buffers");
  EXPECT_EQ(refused({.device = "d", .buffers = 33}), "buffers");
  EXPECT_EQ(refused({.device = "d", .settle_frames = -1}), "settle_frames");
  EXPECT_EQ(refused({.device = "d", .gain_steps_per_unit = 0.0}), "gain_steps_per_unit");
  EXPECT_EQ(refused({.device = "d", .format = {.size = FrameSize{0, 5}}}), "size");
  EXPECT_EQ(refused({.device = "d", .format = {.frames_per_second = 0.0}}), "frames_per_second");
  config_.buffers = 0;
  EXPECT_EQ(error().where, "buffers");
}

}  // namespace
}  // namespace skullstation
