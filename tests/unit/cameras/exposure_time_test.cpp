#include "capture/cameras/exposure_time.h"

#include <gtest/gtest.h>

namespace skullstation {
namespace {

using namespace std::chrono_literals;

const Instant kStamp{10s};

TEST(EarliestExposureStart, ATrustedStartIsTakenAsItIs) {
  EXPECT_EQ(earliest_exposure_start(kStamp, TimestampSource::exposure_start, 40ms, 8ms), kStamp);
}

TEST(EarliestExposureStart, AReadoutStampLiesAtMostFrameAndExposureLater) {
  EXPECT_EQ(earliest_exposure_start(kStamp, TimestampSource::readout, 40ms, 8ms), kStamp - 48ms);
}

TEST(EarliestExposureStart, AnUnknownExposureCountsAsAWholeFrame) {
  EXPECT_EQ(earliest_exposure_start(kStamp, TimestampSource::readout, 40ms, {}), kStamp - 80ms);
}

TEST(FrameInterval, UnknownUntilTwoFramesWereSeen) {
  FrameInterval interval;
  EXPECT_FALSE(interval.value());
  interval.note(kStamp, 7);
  EXPECT_FALSE(interval.value());
  interval.note(kStamp + 50ms, 8);
  EXPECT_EQ(interval.value(), 50ms);
}

TEST(FrameInterval, MissingFramesAreCounted) {
  FrameInterval interval;
  interval.note(kStamp, 7);
  interval.note(kStamp + 150ms, 10);
  EXPECT_EQ(interval.value(), 50ms);
}

TEST(FrameInterval, ACameraThatSlowsDownIsBelievedOverItsClaim) {
  FrameInterval interval(40ms);
  EXPECT_EQ(interval.value(), 40ms);
  interval.note(kStamp, 0);
  interval.note(kStamp + 100ms, 1);
  EXPECT_EQ(interval.value(), 100ms);
  interval.note(kStamp + 130ms, 2);
  EXPECT_EQ(interval.value(), 40ms);
}

TEST(FrameInterval, AClockOrCounterThatRunsBackIsIgnored) {
  FrameInterval interval(40ms);
  interval.note(kStamp, 5);
  interval.note(kStamp - 1s, 6);
  interval.note(kStamp, 2);
  EXPECT_EQ(interval.value(), 40ms);
}

}  // namespace
}  // namespace skullstation
