#include "core/clock.h"

#include <gtest/gtest.h>

#include <thread>

namespace skullstation {
namespace {

using namespace std::chrono_literals;

TEST(SimulatedClock, SleepingAdvancesItAtOnce) {
  SimulatedClock clock;
  const Instant start = clock.now();
  const UtcTime utc_start = clock.utc_now();
  EXPECT_TRUE(clock.sleep_for(1h, {}));
  EXPECT_EQ(clock.now() - start, 1h);
  EXPECT_EQ(clock.utc_now() - utc_start, 1h);
}

TEST(SimulatedClock, NeverRunsBackwards) {
  SimulatedClock clock;
  clock.sleep_for(1h, {});
  const Instant later = clock.now();
  EXPECT_TRUE(clock.sleep_until(later - 30min, {}));
  EXPECT_EQ(clock.now(), later);
}

TEST(SimulatedClock, StandsStillOnceStopped) {
  SimulatedClock clock;
  std::stop_source stop;
  stop.request_stop();
  const Instant before = clock.now();
  EXPECT_FALSE(clock.sleep_for(1s, stop.get_token()));
  EXPECT_EQ(clock.now(), before);
}

TEST(SimulatedClock, SeveralThreadsReachTheLatestDeadline) {
  SimulatedClock clock;
  {
    std::vector<std::jthread> sleepers;
    for (int i = 1; i <= 8; ++i) {
      sleepers.emplace_back([&clock, i] { clock.sleep_until(Instant{i * 1s}, {}); });
    }
  }
  EXPECT_EQ(clock.now(), Instant{8s});
}

TEST(SystemClock, SleepsUntilTheDeadline) {
  SystemClock clock;
  const Instant deadline = clock.now() + 5ms;
  EXPECT_TRUE(clock.sleep_until(deadline, {}));
  EXPECT_GE(clock.now(), deadline);
}

TEST(SystemClock, AStopRequestEndsALongSleep) {
  SystemClock clock;
  std::stop_source stop;
  std::jthread stopper([&stop] { stop.request_stop(); });
  EXPECT_FALSE(clock.sleep_for(24h, stop.get_token()));
}

TEST(Iso8601, IsUtcWithMilliseconds) {
  EXPECT_EQ(to_iso8601(UtcTime{1767225600s + 42ms}), "2026-01-01T00:00:00.042Z");
  EXPECT_EQ(to_iso8601(UtcTime{-1ms}), "1969-12-31T23:59:59.999Z");
}

}  // namespace
}  // namespace skullstation
