#include "capture/cameras/v4l2_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/cameras/scripted_v4l2.h"

namespace skullstation {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScriptedCamera;
using testing::ScriptedV4l2;
using testing::webcam;

class V4l2Format : public ::testing::Test {
 protected:
  V4l2Format() : system_(std::make_shared<ScriptedV4l2>()), camera_(webcam()) {
    system_->plug_in(camera_, 0);
  }

  Result<V4l2StreamFormat> negotiate(const V4l2FormatRequest& request) {
    const auto device = V4l2Device::open(system_, system_->node(0));
    if (!device) return forward(device);
    return negotiate_format(*device, request);
  }

  std::string chosen(const V4l2FormatRequest& request) {
    const auto format = negotiate(request);
    if (!format) return format.error().message();
    return fourcc_name(format->fourcc) + " " + std::to_string(format->image.width);
  }

  Error error(const V4l2FormatRequest& request) {
    const auto format = negotiate(request);
    EXPECT_FALSE(format);
    return format ? Error{} : format.error();
  }

  std::shared_ptr<ScriptedV4l2> system_;
  std::shared_ptr<ScriptedCamera> camera_;
};

TEST_F(V4l2Format, WithoutAWishTheLargestSizeIsTaken) { EXPECT_EQ(chosen({}), "MJPG 1600"); }

TEST_F(V4l2Format, InTheWantedSizeTheBestFormatIsTaken) {
  EXPECT_EQ(chosen({.size = FrameSize{640, 480}}), "YUYV 640");
  EXPECT_EQ(chosen({.size = FrameSize{1600, 1200}}), "MJPG 1600");
}

TEST_F(V4l2Format, TheRateDecidesBetweenFormatsOfOneSize) {
  camera_->rates = {{30, 15}, {30}, {30, 5}};
  EXPECT_EQ(chosen({.size = FrameSize{640, 480}, .frames_per_second = 30}), "YUYV 640");
  camera_->rates = {{30, 15}, {5}, {5}};
  EXPECT_EQ(chosen({.size = FrameSize{640, 480}, .frames_per_second = 30}), "MJPG 640");
}

TEST_F(V4l2Format, ANamedFormatIsTaken) {
  EXPECT_EQ(chosen({.size = FrameSize{640, 480}, .format = "GREY"}), "GREY 640");
}

TEST_F(V4l2Format, FormatsThatCanNotBeReadAreNeverChosen) {
  camera_->formats = {{V4L2_PIX_FMT_H264, "H.264", {{1920, 1080}}, {}},
                      {V4L2_PIX_FMT_SGRBG10, "10-bit Bayer", {{1280, 720}}, {}},
                      {V4L2_PIX_FMT_SGRBG8, "8-bit Bayer", {{1280, 720}}, {}}};
  EXPECT_EQ(chosen({}), "BA10 1280");
  camera_->formats.resize(1);
  const Error told = error({});
  EXPECT_EQ(told.kind, ErrorKind::bad_input);
  EXPECT_THAT(told.message(),
              AllOf(HasSubstr("no pixel format that can be read"), HasSubstr("H264 1920x1080")));
}

TEST_F(V4l2Format, AFormatThatTheDeviceHasNotIsAnErrorThatListsWhatItHas) {
  const Error told = error({.format = "NV12"});
  EXPECT_EQ(told.kind, ErrorKind::bad_input);
  EXPECT_THAT(told.message(), AllOf(HasSubstr("NV12"), HasSubstr("MJPG 640x480 1600x1200"),
                                    HasSubstr("GREY 640x480"), HasSubstr("YUYV 320x240 640x480")));
}

TEST_F(V4l2Format, AFormatThatNobodyKnowsIsAnError) {
  EXPECT_THAT(error({.format = "MJPEG"}).message(), HasSubstr("\"MJPEG\""));
  EXPECT_THAT(error({.format = "H264"}).message(), HasSubstr("\"H264\""));
}

TEST_F(V4l2Format, ASizeThatTheDriverSilentlyChangesIsAnErrorThatNamesBoth) {
  camera_->size_answer = FrameSize{1280, 720};
  const Error told = error({.size = FrameSize{1000, 700}});
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_THAT(told.message(), AllOf(HasSubstr("1000x700"), HasSubstr("1280x720"),
                                    HasSubstr("YUYV 320x240 640x480")));
}

TEST_F(V4l2Format, AnotherSizeIsTakenIfThatIsAllowed) {
  camera_->size_answer = FrameSize{1280, 720};
  EXPECT_EQ(chosen({.size = FrameSize{1000, 700}, .allow_other_size = true}), "YUYV 1280");
}

TEST_F(V4l2Format, AFormatThatTheDriverSilentlyChangesIsAnErrorThatNamesBoth) {
  camera_->format_answer = V4L2_PIX_FMT_GREY;
  EXPECT_THAT(error({.size = FrameSize{640, 480}}).message(),
              AllOf(HasSubstr("YUYV"), HasSubstr("answered with GREY")));
}

TEST_F(V4l2Format, InterlacedPicturesAreRefused) {
  camera_->field_answer = V4L2_FIELD_INTERLACED;
  EXPECT_THAT(error({}).message(), HasSubstr("interlaced"));
}

TEST_F(V4l2Format, TheDriversStrideIsKept) {
  camera_->stride_padding = 32;
  const auto format = negotiate({.size = FrameSize{640, 480}});
  ASSERT_TRUE(format);
  EXPECT_EQ(format->image.stride_bytes, 1312U);
}

TEST_F(V4l2Format, AnySizeOfARangeIsOffered) {
  camera_->formats = {{V4L2_PIX_FMT_MJPEG, "", {{640, 480}}, {}},
                      {V4L2_PIX_FMT_GREY, "", {{4000, 3000}}, FrameSize{16, 16}}};
  EXPECT_EQ(chosen({.size = FrameSize{1234, 1000}}), "GREY 1234");
  EXPECT_EQ(chosen({.size = FrameSize{640, 480}}), "MJPG 640");
  EXPECT_EQ(chosen({}), "GREY 4000");
  EXPECT_THAT(error({.format = "NV12"}).message(), HasSubstr("GREY 16x16 to 4000x3000"));
}

TEST_F(V4l2Format, TheRateIsSetAndReadBack) {
  const auto format = negotiate({.frames_per_second = 12.5});
  ASSERT_TRUE(format);
  EXPECT_EQ(format->frame_interval, std::chrono::milliseconds(80));
}

TEST_F(V4l2Format, ARateThatCanNotBeSetIsAnError) {
  camera_->rate_settable = false;
  const Error told = error({.frames_per_second = 12.5});
  EXPECT_EQ(told.kind, ErrorKind::bad_input);
  EXPECT_THAT(told.message(), HasSubstr("12.5"));
  const auto unset = negotiate({});
  ASSERT_TRUE(unset);
  EXPECT_FALSE(unset->frame_interval);
}

TEST_F(V4l2Format, TheColourEncodingOfTheDriverIsHonoured) {
  const V4l2FormatRequest yuyv{.size = FrameSize{640, 480}};
  auto format = negotiate(yuyv);
  ASSERT_TRUE(format);
  EXPECT_EQ(format->image.encoding, YcbcrEncoding::bt601);
  EXPECT_EQ(format->image.range, SampleRange::limited);
  EXPECT_FALSE(format->image.linear_light);

  camera_->colorspace = V4L2_COLORSPACE_JPEG;
  format = negotiate(yuyv);
  ASSERT_TRUE(format);
  EXPECT_EQ(format->image.range, SampleRange::full);

  camera_->colorspace = V4L2_COLORSPACE_REC709;
  format = negotiate(yuyv);
  ASSERT_TRUE(format);
  EXPECT_EQ(format->image.encoding, YcbcrEncoding::bt709);

  camera_->ycbcr_encoding = V4L2_YCBCR_ENC_BT2020_CONST_LUM;
  EXPECT_THAT(error(yuyv).message(), HasSubstr("colour encoding"));
}

TEST_F(V4l2Format, RawSensorLightIsLinear) {
  camera_->formats = {{V4L2_PIX_FMT_SGRBG10, "", {{640, 480}}, {}}};
  camera_->colorspace = V4L2_COLORSPACE_RAW;
  const auto format = negotiate({});
  ASSERT_TRUE(format);
  EXPECT_TRUE(format->image.linear_light);
  EXPECT_FALSE(format->image.range);
}

TEST_F(V4l2Format, ABrokenDriverThatListsForEverIsCutOff) {
  camera_->formats.assign(5000, camera_->formats.front());
  const auto device = V4l2Device::open(system_, system_->node(0));
  ASSERT_TRUE(device);
  const auto offered = offered_formats(*device);
  ASSERT_TRUE(offered);
  EXPECT_EQ(offered->size(), 1024U);
}

}  // namespace
}  // namespace skullstation
