#include "capture/cameras/v4l2_discovery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

#include "tests/unit/cameras/scripted_v4l2.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using testing::ScriptedCamera;
using testing::ScriptedV4l2;
using testing::webcam;

class V4l2Discovery : public ::testing::Test {
 protected:
  std::string stable_path(int number) {
    const auto device = V4l2Device::open(system_, system_->node(number));
    return device ? stable_path_of(system_, *device) : device.error().message();
  }
  std::string found(const std::string& device) {
    const auto node = find_node(system_, device);
    return node ? *node : node.error().message();
  }

  std::shared_ptr<ScriptedV4l2> system_ = std::make_shared<ScriptedV4l2>();
};

TEST_F(V4l2Discovery, ACameraWithASerialNumberIsKnownByIt) {
  system_->plug_in(webcam(), 3);
  EXPECT_EQ(stable_path(3), system_->by_id());
  EXPECT_EQ(found(system_->by_id()), system_->node(3));
}

TEST_F(V4l2Discovery, WithoutASerialNumberItIsKnownByItsSocket) {
  auto camera = webcam();
  camera->serial.clear();
  system_->plug_in(camera, 3);
  EXPECT_EQ(stable_path(3), system_->by_path());
  EXPECT_EQ(found(system_->by_path()), system_->node(3));
}

TEST_F(V4l2Discovery, WithoutUdevItIsKnownByItsPlaceOnTheBus) {
  auto camera = webcam();
  camera->bus = "platform:vivid-000";
  system_->plug_in(camera, 3, false);
  EXPECT_EQ(stable_path(3), "bus:platform:vivid-000");
  EXPECT_EQ(found("bus:platform:vivid-000"), system_->node(3));
}

TEST_F(V4l2Discovery, SeveralCamerasAtOnePlaceAreNumbered) {
  auto metadata = webcam();
  metadata->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  system_->plug_in(webcam(), 2, false);
  system_->plug_in(metadata, 3, false);
  system_->plug_in(webcam(), 10, false);
  EXPECT_EQ(stable_path(2), "bus:usb-0000:00:14.0-1");
  EXPECT_EQ(stable_path(10), "bus:usb-0000:00:14.0-1#1");
  EXPECT_EQ(found("bus:usb-0000:00:14.0-1#1"), system_->node(10));
}

TEST_F(V4l2Discovery, WhatIsNotThereIsAnError) {
  system_->plug_in(webcam(), 0, false);
  for (const std::string& device :
       {system_->by_id(), system_->node(5), std::string("bus:nowhere"),
        std::string("bus:usb-0000:00:14.0-1#1"), std::string("bus:usb-0000:00:14.0-1#x")}) {
    const auto node = find_node(system_, device);
    ASSERT_FALSE(node) << device;
    EXPECT_EQ(node.error().kind, ErrorKind::hardware);
    EXPECT_EQ(node.error().where, device);
    EXPECT_THAT(node.error().message(), HasSubstr("no such device"));
  }
}

TEST_F(V4l2Discovery, ListsCamerasInOrderAndLeavesOtherNodesOut) {
  auto metadata = webcam();
  metadata->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  auto second = webcam();
  second->model = "Second";
  second->serial.clear();
  system_->plug_in(second, 10, false);
  system_->plug_in(metadata, 1, false);
  system_->plug_in(webcam(), 2);
  std::ofstream(system_->root() / "dev/video-notes").close();
  const auto cameras = list_v4l2_cameras(system_);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].node, system_->node(2));
  EXPECT_EQ(cameras[0].stable_path, system_->by_id());
  EXPECT_EQ(cameras[0].serial, "SN1234");
  EXPECT_EQ(cameras[0].driver, "scripted");
  EXPECT_EQ(cameras[0].formats.size(), 3U);
  EXPECT_EQ(cameras[0].formats[0].description, "Motion-JPEG");
  EXPECT_EQ(cameras[1].model, "Second");
  EXPECT_EQ(cameras[1].problem, "");
  EXPECT_EQ(system_->open_descriptors(), 0);
}

TEST_F(V4l2Discovery, ACameraThatCanNotBeUsedIsListedWithItsProblem) {
  auto camera = webcam();
  camera->open_error = EACCES;
  system_->plug_in(camera, 0);
  auto broken = webcam();
  broken->errors[VIDIOC_ENUM_FMT] = {EIO};
  system_->plug_in(broken, 1, false);
  const auto cameras = list_v4l2_cameras(system_);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_THAT(cameras[0].problem, HasSubstr("no permission"));
  EXPECT_THAT(cameras[1].problem, HasSubstr("input/output error"));
}

TEST_F(V4l2Discovery, AMachineWithoutDevicesHasNone) {
  std::filesystem::remove_all(system_->root() / "dev");
  EXPECT_TRUE(list_v4l2_cameras(system_).empty());
}

}  // namespace
}  // namespace skullstation
