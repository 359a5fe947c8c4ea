#include "firmware_io/signal_player.h"

#include <gmock/gmock.h>

#include <semaphore>

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;

constexpr std::array signals{Signal::off,      Signal::ready, Signal::working, Signal::attention,
                             Signal::building, Signal::done,  Signal::fault};

int beeps(Signal signal) {
  int count = 0;
  bool before = false;
  for (milliseconds t{0}; t < 10s; t += 1ms) {
    const bool on = panel_at(signal, t).buzzer;
    if (on && !before) ++count;
    before = on;
  }
  return count;
}

TEST(SignalPattern, LooksAndSoundsAsTheOperatorLearnt) {
  EXPECT_EQ(panel_at(Signal::off, 0ms), PanelState{});
  EXPECT_EQ(panel_at(Signal::ready, 700ms), (PanelState{.green = true}));
  EXPECT_EQ(panel_at(Signal::working, 700ms), (PanelState{.yellow = true}));
  EXPECT_EQ(panel_at(Signal::attention, 0ms), (PanelState{.yellow = true, .buzzer = true}));
  EXPECT_EQ(panel_at(Signal::attention, 9700ms), PanelState{}) << "blinks";
  EXPECT_EQ(panel_at(Signal::building, 0ms),
            (PanelState{.green = true, .yellow = true, .buzzer = true}));
  EXPECT_EQ(panel_at(Signal::building, 9700ms), (PanelState{.green = true, .yellow = true}))
      << "steady";
  EXPECT_EQ(panel_at(Signal::done, 0ms), (PanelState{.green = true, .buzzer = true}));
  EXPECT_EQ(panel_at(Signal::done, 9700ms), PanelState{}) << "blinks";
  EXPECT_EQ(panel_at(Signal::fault, 0ms), (PanelState{.red = true, .buzzer = true}));
  EXPECT_EQ(panel_at(Signal::fault, 9700ms), (PanelState{.red = true})) << "steady";
  EXPECT_EQ(beeps(Signal::ready), 0);
  EXPECT_EQ(beeps(Signal::working), 0);
  EXPECT_EQ(beeps(Signal::attention), 2);
  EXPECT_EQ(beeps(Signal::building), 1);
  EXPECT_EQ(beeps(Signal::done), 1);
  EXPECT_EQ(beeps(Signal::fault), 3);
}

TEST(SignalPattern, NextChangeMissesNone) {
  for (const Signal signal : signals) {
    for (milliseconds t{0}; t < 5s; t += 61ms) {
      const auto next = next_change(signal, t);
      const milliseconds end = next.value_or(t + 5s);
      ASSERT_GT(end, t);
      for (milliseconds between = t; between < end; between += 1ms) {
        ASSERT_EQ(panel_at(signal, between), panel_at(signal, t))
            << static_cast<int>(signal) << " at " << between.count();
      }
    }
  }
}

TEST(SignalPlayer, PlaysOnByItself) {
  std::binary_semaphore dark(0);
  std::mutex mutex;
  std::vector<PanelState> shown;
  SignalPlayer player([&](PanelState state) -> Result<void> {
    const std::lock_guard lock(mutex);
    shown.push_back(state);
    if (!state.yellow && shown.size() > 2) dark.release();
    return {};
  });
  ASSERT_TRUE(player.show(Signal::attention));
  ASSERT_TRUE(dark.try_acquire_for(20s)) << "it blinks";
  const std::lock_guard lock(mutex);
  EXPECT_EQ(shown.front(), panel_at(Signal::attention, 0ms)) << "at once";
}

TEST(SignalPlayer, TellsThatTheLinesFail) {
  std::atomic<bool> broken = false;
  std::binary_semaphore failed_alone(0);
  SignalPlayer player([&](PanelState) -> Result<void> {
    if (!broken) return {};
    failed_alone.release();
    return fail(ErrorKind::hardware, "lamp-yellow", "broke");
  });
  ASSERT_TRUE(player.show(Signal::attention));
  broken = true;
  ASSERT_TRUE(failed_alone.try_acquire_for(20s));
  const auto shown = player.show(Signal::ready);
  ASSERT_FALSE(shown);
  EXPECT_EQ(shown.error().message(), "lamp-yellow: broke");
}

TEST(SignalPlayer, GoesDarkAtTheEnd) {
  PanelState last;
  {
    SignalPlayer player([&](PanelState state) -> Result<void> {
      last = state;
      return {};
    });
    ASSERT_TRUE(player.show(Signal::fault));
    EXPECT_TRUE(last.red);
  }
  EXPECT_EQ(last, PanelState{});
}

}  // namespace
}  // namespace skullstation
