#include "daemon/http/limits.h"

#include <gtest/gtest.h>

namespace skullstation {
namespace {

using namespace std::chrono_literals;

TEST(RequestLimit, FillsAgain) {
  RequestLimit limit(10.0, 5.0);
  Instant now{};
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(limit.take("a", now));
  EXPECT_FALSE(limit.take("a", now));
  EXPECT_TRUE(limit.take("b", now)) << "everybody has his own";
  EXPECT_TRUE(limit.take("a", now + 100ms));
  EXPECT_FALSE(limit.take("a", now + 100ms));
}

TEST(GuessLimit, AThousandGuessesGetNowhere) {
  SimulatedClock clock;
  GuessLimit limit(clock);
  int looked_at = 0;
  for (int i = 0; i < 1000; ++i) {
    if (limit.begin("admin", "10.0.0.1") == 0s) ++looked_at;
    clock.sleep_for(1s, {});
  }
  // 5 at once, then after 2, 4, 8 … 512 s.
  EXPECT_GE(looked_at, 5);
  EXPECT_LE(looked_at, 15);
  EXPECT_GT(limit.begin("admin", "10.0.0.2"), 0s) << "another address, the same account";
  EXPECT_GT(limit.begin("other", "10.0.0.1"), 0s) << "another account, the same address";
  EXPECT_EQ(limit.begin("other", "10.0.0.2"), 0s);
}

TEST(GuessLimit, WhoKnowsItIsLetIn) {
  SimulatedClock clock;
  GuessLimit limit(clock);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(limit.begin("admin", "10.0.0.1"), 0s);
    limit.right("admin", "10.0.0.1");
  }
  for (int i = 0; i < 5; ++i) EXPECT_EQ(limit.begin("admin", "10.0.0.1"), 0s);
  EXPECT_GT(limit.begin("admin", "10.0.0.1"), 0s);
  clock.sleep_for(15min, {});
  EXPECT_EQ(limit.begin("admin", "10.0.0.1"), 0s) << "nobody waits longer than that";
}

}  // namespace
}  // namespace skullstation
