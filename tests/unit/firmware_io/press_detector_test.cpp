#include "firmware_io/press_detector.h"

#include <gmock/gmock.h>

#include "core/random.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;

class PressDetectorTest : public testing::Test {
 protected:
  void edge(std::chrono::nanoseconds at, bool down) { detector_.edge(Instant{at}, down); }

  std::vector<Press> presses(std::chrono::nanoseconds until) {
    std::vector<Press> presses;
    for (const auto& detected : detector_.advance(Instant{until})) {
      presses.push_back(detected.press);
    }
    return presses;
  }

  PressDetector detector_{ButtonTiming{20ms, 1500ms}};
};

using Presses = std::vector<Press>;

TEST_F(PressDetectorTest, BriefIsToldOnceTheReleaseIsCertain) {
  edge(100ms, true);
  EXPECT_EQ(presses(150ms), Presses{});
  edge(300ms, false);
  EXPECT_EQ(presses(319ms), Presses{});
  EXPECT_EQ(presses(320ms), Presses{Press::brief});
  EXPECT_EQ(presses(5s), Presses{}) << "once";
}

TEST_F(PressDetectorTest, HeldIsToldWhileDownAndTheReleaseTellsNothing) {
  edge(100ms, true);
  EXPECT_EQ(presses(1599ms), Presses{});
  EXPECT_EQ(presses(1600ms), Presses{Press::held});
  edge(4s, false);
  EXPECT_EQ(presses(10s), Presses{});
}

TEST_F(PressDetectorTest, JustTooShortForHeldIsBrief) {
  edge(100ms, true);
  edge(1595ms, false);
  EXPECT_EQ(presses(1610ms), Presses{}) << "not held: it is up, though not yet for certain";
  EXPECT_EQ(presses(1615ms), Presses{Press::brief});
}

TEST_F(PressDetectorTest, GlitchesAreNothing) {
  for (int i = 0; i < 100; ++i) {
    edge(i * 100ms, true);
    edge(i * 100ms + 19ms, false);
  }
  EXPECT_EQ(presses(20s), Presses{});
  edge(30s, true);
  edge(31s, false);  // a gap in the contact is no release
  edge(31s + 10ms, true);
  EXPECT_EQ(presses(31400ms), Presses{});
  EXPECT_EQ(presses(31500ms), Presses{Press::held});
}

TEST_F(PressDetectorTest, EdgesAloneTellWhatPassedBetweenThem) {
  edge(0ms, true);
  edge(200ms, false);
  edge(400ms, true);
  edge(2400ms, false);
  edge(2600ms, true);
  edge(2700ms, false);
  EXPECT_EQ(presses(2720ms), (Presses{Press::brief, Press::held, Press::brief}));
}

TEST_F(PressDetectorTest, SaysWhenItWillKnowMore) {
  EXPECT_EQ(detector_.next_decision(), std::nullopt);
  edge(100ms, true);
  EXPECT_EQ(detector_.next_decision(), Instant{120ms});
  EXPECT_EQ(presses(120ms), Presses{});
  EXPECT_EQ(detector_.next_decision(), Instant{1600ms});
  EXPECT_EQ(presses(1600ms), Presses{Press::held});
  EXPECT_EQ(detector_.next_decision(), std::nullopt);
  edge(2000ms, false);
  EXPECT_EQ(detector_.next_decision(), Instant{2020ms});
}

TEST_F(PressDetectorTest, RandomBouncesChangeNothing) {
  Random random(5);
  for (int trial = 0; trial < 500; ++trial) {
    PressDetector detector(ButtonTiming{});
    const auto bounce = [&](std::chrono::milliseconds at, bool down) {
      Instant t{at};
      detector.edge(t, down);
      for (std::uint64_t i = random.below(8); i > 0; --i) {
        detector.edge(t += std::chrono::microseconds{random.below(9000)}, random.below(2) == 0);
      }
      detector.edge(t += 1ms, down);
    };
    const bool held = random.below(2) == 0;
    bounce(0ms, true);
    bounce(held ? 2000ms : 600ms, false);
    const auto detected = detector.advance(Instant{10s});
    ASSERT_EQ(detected.size(), 1u) << trial;
    ASSERT_EQ(detected[0].press, held ? Press::held : Press::brief) << trial;
  }
}

TEST(ButtonTiming, SaysWhichValueIsWrong) {
  using testing::HasSubstr;
  EXPECT_TRUE(ButtonTiming{}.validate());
  EXPECT_TRUE((ButtonTiming{0ms, 500ms}.validate()));
  EXPECT_THAT((ButtonTiming{201ms, 1500ms}.validate().error().message()),
              HasSubstr("debounce_ms: is 201; 0 to 200"));
  EXPECT_THAT((ButtonTiming{50ms, 150ms}.validate().error().message()),
              HasSubstr("held_after_ms: is 150; 200"));
}

}  // namespace
}  // namespace skullstation
