// The parts of the libcamera backend that need no camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libcamera/control_ids.h>
#include <libcamera/formats.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/cameras/libcamera_controls.h"
#include "capture/cameras/libcamera_format.h"
#include "capture/cameras/libcamera_stream.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
namespace formats = libcamera::formats;
namespace ids = libcamera::controls;
using libcamera::ControlInfo;
using libcamera::ControlInfoMap;
using libcamera::ControlList;
using libcamera::ControlValue;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(LibcameraFormat, RgbIsNamedInReverseOfItsMemory) {
  EXPECT_EQ(pixel_format_from_libcamera(formats::RGB888), (PixelFormat{PixelLayout::bgr}));
  EXPECT_EQ(pixel_format_from_libcamera(formats::BGR888), (PixelFormat{PixelLayout::rgb}));
}

TEST(LibcameraFormat, PackedAndUnpackedBayerAreToldApart) {
  EXPECT_EQ(pixel_format_from_libcamera(formats::SBGGR12),
            (PixelFormat{PixelLayout::bayer, 12, false, BayerOrder::bggr}));
  EXPECT_EQ(pixel_format_from_libcamera(formats::SBGGR12_CSI2P),
            (PixelFormat{PixelLayout::bayer, 12, true, BayerOrder::bggr}));
  EXPECT_FALSE(pixel_format_from_libcamera(formats::SBGGR10_IPU3));
}

TEST(LibcameraFormat, TheBestFormatIsChosen) {
  EXPECT_EQ(best_libcamera_format({formats::SBGGR10, formats::NV12, formats::RGB888}),
            formats::RGB888);
  EXPECT_EQ(best_libcamera_format({formats::R8, formats::SBGGR10, formats::SGBRG12}),
            formats::SGBRG12);
  EXPECT_FALSE(best_libcamera_format({formats::YUV420}));
}

TEST(LibcameraFormat, StrideAndColourSpaceAreTaken) {
  libcamera::StreamConfiguration stream;
  stream.pixelFormat = formats::NV12;
  stream.size = {640, 480};
  stream.stride = 704;
  stream.colorSpace = libcamera::ColorSpace::Rec709;
  RawImageFormat image = image_format(stream);
  EXPECT_EQ(image.stride_bytes, 704U);
  EXPECT_EQ(image.encoding, YcbcrEncoding::bt709);
  EXPECT_EQ(image.range, SampleRange::limited);
  EXPECT_FALSE(image.linear_light);

  stream.colorSpace = libcamera::ColorSpace::Sycc;
  image = image_format(stream);
  EXPECT_EQ(image.encoding, YcbcrEncoding::bt601);
  EXPECT_EQ(image.range, SampleRange::full);

  stream.pixelFormat = formats::SRGGB10;
  stream.stride = 0;
  stream.colorSpace = libcamera::ColorSpace::Raw;
  image = image_format(stream);
  EXPECT_EQ(image.stride_bytes, 1280U);
  EXPECT_TRUE(image.linear_light);
}

ControlInfoMap sensor_controls() {
  return {
      ControlInfoMap::Map{
          {&ids::AeEnable, ControlInfo(false, true, true)},
          {&ids::ExposureTime, ControlInfo(100, 60'000, 10'000)},
          {&ids::AnalogueGain, ControlInfo(1.0F, 16.0F, 1.0F)},
          {&ids::AfMode, ControlInfo(0, 2, 0)},
          {&ids::LensPosition, ControlInfo(0.0F, 12.0F, 1.0F)},
          {&ids::FrameDurationLimits, ControlInfo(std::int64_t{10'000}, std::int64_t{1'000'000})},
      },
      ids::controls};
}

TEST(LibcameraControls, NamesFollowTheCommonRule) {
  EXPECT_EQ(snake_case("ExposureTime"), "exposure_time");
  EXPECT_EQ(snake_case("Lux"), "lux");
}

TEST(LibcameraControls, AreListedWithTheValuesOfTheLastPicture) {
  const ControlInfoMap available = sensor_controls();
  ControlList metadata(ids::controls);
  metadata.set(ids::ExposureTime, 8000);
  metadata.set(ids::AnalogueGain, 2.5F);
  const auto controls = list_controls(available, metadata);
  std::vector<std::string> names;
  for (const CameraControl& control : controls) names.push_back(control.name);
  EXPECT_THAT(names, ElementsAre("ae_enable", "af_mode", "analogue_gain_milli", "exposure_time",
                                 "frame_duration_limits", "lens_position_milli"));
  EXPECT_EQ(controls[2].value, 2500);
  EXPECT_EQ(controls[2].maximum, 16'000);
  EXPECT_EQ(controls[3].value, 8000);
  EXPECT_EQ(controls[0].value, 1);  // not told: the default
}

TEST(LibcameraControls, SettingsSwitchTheirAutomaticsOff) {
  const auto list =
      controls_for(sensor_controls(), {.exposure = 8ms, .gain = 2.0, .focus = 0.5}, "cam");
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_EQ(list->get(ids::AeEnable), false);
  EXPECT_EQ(list->get(ids::ExposureTime), 8000);
  EXPECT_EQ(list->get(ids::AnalogueGain), 2.0F);
  EXPECT_EQ(list->get(ids::AfMode), std::int32_t{ids::AfModeManual});
  EXPECT_EQ(list->get(ids::LensPosition), 6.0F);
  EXPECT_FALSE(list->contains(ids::FrameDurationLimits.id()));
  EXPECT_TRUE(controls_for(sensor_controls(), {}, "cam")->empty());
}

TEST(LibcameraControls, ALongExposureGetsLongerFrames) {
  const auto list = controls_for(sensor_controls(), {.exposure = 50ms}, "cam");
  ASSERT_TRUE(list);
  const auto limits = list->get(ids::FrameDurationLimits);
  ASSERT_TRUE(limits);
  EXPECT_EQ((*limits)[0], 52'000);
  EXPECT_EQ((*limits)[1], 52'000);
}

TEST(LibcameraControls, WhatTheCameraHasNotOrCanNotIsNamed) {
  const auto white_balance = controls_for(sensor_controls(), {.white_balance_k = 5000}, "cam");
  ASSERT_FALSE(white_balance);
  EXPECT_EQ(white_balance.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(white_balance.error().message(), HasSubstr("no control for white_balance_k"));
  const auto exposure = controls_for(sensor_controls(), {.exposure = 1s}, "cam");
  ASSERT_FALSE(exposure);
  EXPECT_THAT(exposure.error().message(),
              AllOf(HasSubstr("control exposure_time"), HasSubstr("100..60000")));
  EXPECT_FALSE(controls_for(ControlInfoMap{}, {.focus = 0.5}, "cam"));
}

TEST(LibcameraControls, WhatWasReallyUsedIsReadFromTheMetadata) {
  const auto asked = controls_for(sensor_controls(), {.exposure = 8ms, .gain = 2.0}, "cam");
  ASSERT_TRUE(asked);
  ControlList metadata(ids::controls);
  metadata.set(ids::ExposureTime, 7989);
  const auto untold = settings_in_force(*asked, metadata, "cam");
  ASSERT_FALSE(untold);
  EXPECT_THAT(untold.error().message(),
              AllOf(HasSubstr("analogue_gain_milli"), HasSubstr("does not tell")));
  metadata.set(ids::AnalogueGain, 1.99F);
  const auto locked = settings_in_force(*asked, metadata, "cam");
  ASSERT_TRUE(locked) << locked.error().message();
  ASSERT_EQ(locked->size(), 2U);
  EXPECT_EQ((*locked)[0].control, "exposure_time");
  EXPECT_EQ((*locked)[0].asked, 8000);
  EXPECT_EQ((*locked)[0].in_force, 7989);
  EXPECT_EQ((*locked)[1].in_force, 1990);
  EXPECT_EQ(exposure_of(metadata), 7989us);
  EXPECT_FALSE(sensor_timestamp_of(metadata));
  EXPECT_FALSE(frame_duration_of(metadata));
}

/// The queue only hands pointers on, so these need not lead to requests.
libcamera::Request* token(std::uintptr_t number) {
  return reinterpret_cast<libcamera::Request*>(number * alignof(std::max_align_t));
}

class LibcameraQueue : public ::testing::Test {
 protected:
  using Wake = CompletionQueue::Wake;

  Wake next(std::chrono::nanoseconds patience = 1h, std::stop_token stop = {}) {
    return queue_.next(std::chrono::steady_clock::now() + patience, std::move(stop), request_);
  }

  CompletionQueue queue_;
  libcamera::Request* request_ = nullptr;
};

TEST_F(LibcameraQueue, HandsRequestsOverInOrder) {
  const std::jthread pipeline([this] {
    queue_.completed(token(1));
    queue_.completed(token(2));
  });
  EXPECT_EQ(next(), Wake::request);
  EXPECT_EQ(request_, token(1));
  EXPECT_EQ(next(), Wake::request);
  EXPECT_EQ(request_, token(2));
}

TEST_F(LibcameraQueue, TimesOut) {
  EXPECT_EQ(next(1ms), Wake::timed_out);
  queue_.completed(token(1));
  queue_.clear();
  EXPECT_EQ(next(1ms), Wake::timed_out);
}

TEST_F(LibcameraQueue, AStopRequestEndsTheWait) {
  std::stop_source stop;
  const std::jthread operator_thread([&stop] { stop.request_stop(); });
  EXPECT_EQ(next(1h, stop.get_token()), Wake::stopped);
}

TEST_F(LibcameraQueue, AnUnpluggedCameraEndsTheWaitForGood) {
  const std::jthread pipeline([this] { queue_.disconnected(); });
  EXPECT_EQ(next(), Wake::unplugged);
  queue_.completed(token(1));
  EXPECT_EQ(next(), Wake::unplugged);
}

}  // namespace
}  // namespace skullstation
