// Streaming: which pictures get through, what is said when none does, and the way back.
#include "capture/cameras/v4l2_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <map>

#include "core/session/image_file.h"
#include "tests/unit/cameras/scripted_v4l2.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScriptedCamera;
using testing::ScriptedFrame;
using testing::ScriptedV4l2;
using testing::webcam;

class V4l2CameraStream : public ::testing::Test {
 protected:
  V4l2CameraStream() : system_(std::make_shared<ScriptedV4l2>()), device_(webcam()) {
    config_.device = system_->plug_in(device_, 0);
    config_.format.size = FrameSize{320, 240};
    config_.settle_frames = 0;
  }

  Camera& camera() {
    if (!camera_) {
      auto opened = open_v4l2_camera(config_, system_);
      if (!opened) throw std::runtime_error(opened.error().message());
      camera_ = std::move(*opened);
    }
    return *camera_;
  }

  Result<Frame> frame(std::chrono::milliseconds timeout = 1000ms) {
    return camera().frame_after(system_->now(), timeout, {});
  }

  Error error(std::chrono::milliseconds timeout = 1000ms) {
    const auto result = frame(timeout);
    EXPECT_FALSE(result);
    return result ? Error{} : result.error();
  }

  int queued_again() const {
    return static_cast<int>(std::count(system_->calls.begin(), system_->calls.end(), VIDIOC_QBUF)) -
           config_.buffers;
  }
  int taken() const {
    return static_cast<int>(std::count(system_->calls.begin(), system_->calls.end(), VIDIOC_DQBUF));
  }

  std::shared_ptr<ScriptedV4l2> system_;
  std::shared_ptr<ScriptedCamera> device_;
  V4l2CameraConfig config_;
  std::unique_ptr<Camera> camera_;
};

TEST_F(V4l2CameraStream, APictureIsDecodedAsTheDriverDescribesIt) {
  device_->stride_padding = 48;
  device_->fill = 128;  // Y' = Cb = Cr = 128: grey of (128 - 16) * 255 / 219
  const auto result = frame();
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_EQ(result->image, Image8(320, 240, 3, 130));
}

TEST_F(V4l2CameraStream, OnlyPicturesExposedAfterTheMomentAskedForAreReturned) {
  camera();
  system_->advance(10s);  // every buffer is filled with old pictures by now
  const Instant moment = system_->now() + 90ms;
  const auto result = camera().frame_after(moment, 1000ms, {});
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_GE(result->exposure_start, moment);
  EXPECT_LE(result->exposure_start, moment + 40ms);
  EXPECT_GT(taken(), config_.buffers);
  EXPECT_EQ(queued_again(), taken());
}

TEST_F(V4l2CameraStream, ALateStampOfAnEarlyExposureDoesNotPass) {
  // Stamped at the end of the readout: the exposure began up to a frame and an exposure earlier.
  device_->timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  camera();
  ASSERT_TRUE(camera().lock({.exposure = 8ms}));
  const Instant moment = system_->now() + 200ms;
  const auto result = camera().frame_after(moment, 1000ms, {});
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_GE(result->exposure_start, moment);
  EXPECT_GE(system_->now(), moment + 40ms + 8ms);
}

TEST_F(V4l2CameraStream, TheStampOfUvcCamerasCountsAsReadout) {
  device_->driver = "uvcvideo";  // flags its stamps as start of exposure, which they are not
  const Instant moment = system_->now() + 200ms;
  const auto result = camera().frame_after(moment, 1000ms, {});
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_GE(system_->now(), moment + 80ms);  // automatic exposure: up to a whole frame
}

TEST_F(V4l2CameraStream, WithoutAnyRateTheFirstFrameOnlyTellsTheInterval) {
  device_->rate_settable = false;
  device_->timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  ASSERT_TRUE(frame());
  EXPECT_GE(taken(), 2);
}

TEST_F(V4l2CameraStream, AFrameStampedInTheFutureIsTakenAsExposedNow) {
  camera();
  device_->script = {{.age = -30ms}};
  const auto result = frame();
  ASSERT_TRUE(result);
  EXPECT_LE(result->exposure_start, system_->now());
}

TEST_F(V4l2CameraStream, TimestampsOfAnotherClockAreAnError) {
  device_->script = {{.age = -std::chrono::hours(480000)}};
  const Error told = error();
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_THAT(told.message(), HasSubstr("monotonic clock"));
}

TEST_F(V4l2CameraStream, DamagedPicturesAreDroppedAndTheirBuffersGoBack) {
  device_->script.assign(10, {.damaged = true});
  ASSERT_TRUE(frame());
  EXPECT_EQ(taken(), 11);
  EXPECT_EQ(queued_again(), 11);
}

TEST_F(V4l2CameraStream, ShortPicturesAreDropped) {
  device_->script.assign(3, {.bytes = std::vector<std::uint8_t>(1000)});
  const auto result = frame();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->sequence, 3U);
}

TEST_F(V4l2CameraStream, DroppedFramesLeaveAGapInTheSequence) {
  device_->script = {{}, {.dropped = true}, {.dropped = true}, {}};
  EXPECT_EQ(frame()->sequence, 0U);
  EXPECT_EQ(frame()->sequence, 3U);
}

TEST_F(V4l2CameraStream, ACameraThatDeliversNothingTimesOutAndRecovers) {
  device_->all_dropped = true;
  const Instant before = system_->now();
  const Error told = error(500ms);
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_EQ(told.where, system_->node(0));
  EXPECT_THAT(told.message(), AllOf(HasSubstr("500ms"), HasSubstr("none came")));
  EXPECT_EQ(system_->now(), before + 500ms);
  device_->all_dropped = false;
  EXPECT_TRUE(frame());
}

TEST_F(V4l2CameraStream, TheTimeOutSaysWhatWasWrongWithThePicturesThatCame) {
  device_->script.assign(5, {.damaged = true});
  for (int i = 0; i < 5; ++i) device_->script.push_back({.age = 10s});
  device_->script.push_back({.bytes = std::vector<std::uint8_t>(7)});
  device_->script.insert(device_->script.end(), 100, {.dropped = true});
  EXPECT_THAT(error().message(),
              AllOf(HasSubstr("5 too old, 6 damaged"), HasSubstr("cut short: 7 of")));
}

TEST_F(V4l2CameraStream, OldPicturesWithoutEndStillTimeOut) {
  device_->script.assign(1000, {.age = 10s});
  EXPECT_THAT(error(1000ms).message(), HasSubstr("too old"));
}

TEST_F(V4l2CameraStream, CorruptJpegsAreDroppedAndGoodOnesDecoded) {
  config_.format.format = "MJPG";
  config_.format.size = FrameSize{640, 480};
  const std::string jpeg = encode_jpeg(Image8(640, 480, 3, 90), 90);
  device_->picture.assign(jpeg.begin(), jpeg.end());
  const std::vector<std::uint8_t> half(jpeg.begin(),
                                       jpeg.begin() + static_cast<std::ptrdiff_t>(jpeg.size() / 2));
  device_->script.assign(3, {.bytes = half});
  const auto result = frame();
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_EQ(result->sequence, 3U);
  EXPECT_EQ(result->image, Image8(640, 480, 3, 90));
  EXPECT_EQ(camera().description().format, "MJPG 640x480 25 fps");

  device_->picture = half;
  EXPECT_THAT(error().message(), AllOf(HasSubstr("damaged"), HasSubstr("JPEG")));
}

TEST_F(V4l2CameraStream, BrokenStreamsAreErrorsOfTheirOwn) {
  const std::vector<std::pair<int, const char*>> cases{{EIO, "input/output error"},
                                                       {EPIPE, "stream broke"},
                                                       {ENODEV, "unplugged"},
                                                       {EINVAL, "taking a picture"}};
  for (const auto& [number, words] : cases) {
    device_->errors[VIDIOC_DQBUF] = {number};
    const Error told = error();
    EXPECT_EQ(told.kind, ErrorKind::hardware);
    EXPECT_THAT(told.message(), HasSubstr(words));
    ASSERT_TRUE(camera().reopen());
    EXPECT_TRUE(frame());
  }
}

TEST_F(V4l2CameraStream, AWakeUpForNothingIsWaitedOut) {
  device_->errors[VIDIOC_DQBUF] = {EAGAIN, EAGAIN};
  EXPECT_TRUE(frame());
}

TEST_F(V4l2CameraStream, AHangUpWithoutAReasonIsABrokenStream) {
  camera();
  device_->hangs_up = true;
  EXPECT_THAT(error().message(), HasSubstr("stream broke"));
}

TEST_F(V4l2CameraStream, ABufferThatCanNotBeHandedBackIsAnError) {
  camera();
  device_->errors[VIDIOC_QBUF] = {EIO};
  EXPECT_THAT(error().message(), HasSubstr("handing a buffer back"));
}

TEST_F(V4l2CameraStream, AStopRequestDuringTheWaitEndsIt) {
  device_->all_dropped = true;
  std::stop_source stop;
  int waits = 0;
  device_->script.assign(3, {.damaged = true});
  device_->all_dropped = false;
  system_->on_wait = [&] {
    if (++waits == 3) stop.request_stop();
  };
  const auto result = camera().frame_after(system_->now(), 10s, stop.get_token());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(waits, 3);
}

TEST_F(V4l2CameraStream, FramesThatMayShowOldSettingsAreDiscarded) {
  config_.settle_frames = 3;
  ASSERT_TRUE(frame());
  EXPECT_EQ(taken(), 4);
  ASSERT_TRUE(frame());
  EXPECT_EQ(taken(), 5);
  ASSERT_TRUE(camera().lock({.exposure = 8ms}));
  // Even for a caller who would take anything.
  const Instant locked_at = system_->now();
  const auto result = camera().frame_after(Instant{}, 1000ms, {});
  ASSERT_TRUE(result);
  EXPECT_GE(result->exposure_start, locked_at);
  EXPECT_EQ(taken(), 9);
}

TEST_F(V4l2CameraStream, TheExposureIsReportedOnceItIsLocked) {
  EXPECT_FALSE(frame()->exposure);
  ASSERT_TRUE(camera().lock({.exposure = 8030us}));
  EXPECT_EQ(frame()->exposure, 8000us);
}

TEST_F(V4l2CameraStream, SettingsThatMakeNoSenseAreRefused) {
  const auto locked = camera().lock({.focus = 2.0});
  ASSERT_FALSE(locked);
  EXPECT_EQ(locked.error().kind, ErrorKind::bad_input);
}

// --- Unplugged and back --------------------------------------------------------------------------

TEST_F(V4l2CameraStream, UnpluggedWhileStreaming) {
  ASSERT_TRUE(frame());
  system_->unplug(0);
  const Error told = error();
  EXPECT_EQ(told.kind, ErrorKind::hardware);
  EXPECT_THAT(told.message(), HasSubstr("unplugged"));

  const auto absent = camera().reopen();
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::hardware);
  EXPECT_THAT(absent.error().message(), HasSubstr("no such device"));
  EXPECT_EQ(system_->open_descriptors(), 0);
  EXPECT_EQ(system_->mapped_buffers(), 0);
  EXPECT_THAT(error().message(), HasSubstr("closed"));
  EXPECT_FALSE(camera().controls());
  EXPECT_FALSE(camera().lock({}));
}

TEST_F(V4l2CameraStream, PluggedInAgainUnderAnotherNumberItGoesOnWithItsSettings) {
  ASSERT_TRUE(camera().lock({.exposure = 8ms}));
  ASSERT_TRUE(camera().lock({.gain = 1.0}));
  const std::uint32_t before = frame()->sequence;
  system_->unplug(0);
  error();
  auto same = webcam();  // power was lost: all automatics are on again
  system_->plug_in(same, 5);
  ASSERT_TRUE(camera().reopen()) << camera().reopen().error().message();
  const auto result = frame();
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_EQ(result->exposure, 8ms);
  EXPECT_GT(result->sequence, before);
  std::map<std::string, std::int64_t> values;
  for (const auto& control : same->controls) values[control.name] = control.value;
  EXPECT_EQ(values["Auto Exposure"], 1);
  EXPECT_EQ(values["Exposure Time, Absolute"], 80);
  EXPECT_EQ(values["Gain"], 16);
  EXPECT_EQ(values["White Balance, Automatic"], 1);  // was never locked
  EXPECT_EQ(camera().description().stable_path, system_->by_id());
}

TEST_F(V4l2CameraStream, WithoutUdevItIsFoundAgainByItsPlaceOnTheBus) {
  system_->unplug(0);
  config_.device = system_->plug_in(device_, 1, false);
  ASSERT_TRUE(frame());
  EXPECT_EQ(camera().description().stable_path, "bus:usb-0000:00:14.0-1");
  system_->unplug(1);
  error();
  system_->plug_in(webcam(), 4, false);
  ASSERT_TRUE(camera().reopen());
  EXPECT_TRUE(frame());
}

TEST_F(V4l2CameraStream, AnotherModelInItsSocketIsNotTakenForIt) {
  config_.device = system_->by_path();
  ASSERT_TRUE(frame());
  EXPECT_EQ(camera().description().stable_path, system_->by_path());
  system_->unplug(0);
  auto other = webcam();
  other->model = "Toy Camera";
  system_->plug_in(other, 0);
  const auto reopened = camera().reopen();
  ASSERT_FALSE(reopened);
  EXPECT_THAT(reopened.error().message(),
              AllOf(HasSubstr("Toy Camera"), HasSubstr("Scripted Camera")));
}

TEST_F(V4l2CameraStream, IfSettingsCanNotBeLockedAgainItStaysClosed) {
  ASSERT_TRUE(camera().lock({.focus = 0.5}));
  std::erase_if(device_->controls,
                [](const auto& control) { return control.name == "Focus, Absolute"; });
  const auto reopened = camera().reopen();
  ASSERT_FALSE(reopened);
  EXPECT_THAT(reopened.error().message(), HasSubstr("focus"));
  EXPECT_THAT(error().message(), HasSubstr("closed"));
  EXPECT_EQ(system_->open_descriptors(), 0);
}

}  // namespace
}  // namespace skullstation
