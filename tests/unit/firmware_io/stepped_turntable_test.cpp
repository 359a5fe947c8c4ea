#include "firmware_io/stepped_turntable.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <numeric>

#include "core/units.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// What a motor was told, in virtual time.
struct Bench {
  struct Step {
    Instant at;
    int direction;
  };

  long position() const {
    return std::accumulate(steps.begin(), steps.end(), 0L,
                           [](long sum, const Step& step) { return sum + step.direction; });
  }

  SimulatedClock clock;
  std::vector<Step> steps;
  int direction = 0;
  bool current = false;
  // What happens, by the number of steps made so far.
  std::function<bool(long position)> index = [](long position) {
    return wrapped_deg(static_cast<double>(position) * 0.9 - 100.0) < 6.0;
  };
  std::function<std::chrono::nanoseconds(std::size_t made)> lateness = [](std::size_t) {
    return 0ns;
  };
  std::function<void(std::size_t made)> before_step = [](std::size_t) {};
  std::optional<std::size_t> breaks_at;
  bool real_time_refused = false;
};

class BenchDriver final : public StepDriver {
 public:
  explicit BenchDriver(Bench& bench) : bench_(bench) {}

  Result<void> set_current(bool on) override {
    bench_.current = on;
    return {};
  }
  Result<void> set_direction(int direction) override {
    bench_.direction = direction;
    return {};
  }
  Result<void> step() override {
    if (bench_.breaks_at == bench_.steps.size()) {
      return fail(ErrorKind::hardware, "step line", "broke");
    }
    EXPECT_TRUE(bench_.current);
    bench_.steps.push_back({bench_.clock.now(), bench_.direction});
    return {};
  }
  Result<bool> index_closed() override { return bench_.index(bench_.position()); }
  Result<void> prepare_thread() override {
    if (bench_.real_time_refused) return fail(ErrorKind::hardware, "stepping", "refused");
    return {};
  }
  void wait_until(Instant deadline) override {
    bench_.clock.sleep_until(deadline + bench_.lateness(bench_.steps.size()), {});
    bench_.before_step(bench_.steps.size());
  }

 private:
  Bench& bench_;
};

class SteppedTurntableTest : public testing::Test {
 protected:
  SteppedTurntableTest() {
    config_.limits = {.steps_per_turn = 400,
                      .max_speed_deg_s = 60,
                      .max_acceleration_deg_s2 = 120,
                      .max_jerk_deg_s3 = 480};
    config_.backlash_deg = 2.7;  // 3 steps
  }

  void TearDown() override {
    table_.reset();
    EXPECT_FALSE(bench_.current) << "off at the end, whatever happened";
  }

  SteppedTurntable& table() {
    if (!table_) {
      table_ = std::make_unique<SteppedTurntable>(std::make_unique<BenchDriver>(bench_), latch_,
                                                  config_, bench_.clock);
    }
    return *table_;
  }

  void home() {
    const auto homed = table().home({});
    ASSERT_TRUE(homed) << homed.error().message();
    bench_.steps.clear();
  }

  /// The directions of what was made since the last clear(), run by run: {-13, +3}.
  std::vector<long> runs() const {
    std::vector<long> runs;
    for (const auto& step : bench_.steps) {
      if (runs.empty() || (runs.back() > 0) != (step.direction > 0)) runs.push_back(0);
      runs.back() += step.direction;
    }
    return runs;
  }

  Bench bench_;
  std::shared_ptr<TripLatch> latch_ = std::make_shared<TripLatch>(TripLatch::Backend{
      [] { return Result<std::string>(""); }, [this] { bench_.current = false; }});
  TurntableConfig config_;

 private:
  std::unique_ptr<SteppedTurntable> table_;
};

TEST_F(SteppedTurntableTest, EndsEveryMoveCounterClockwiseOverTheBacklash) {
  home();
  ASSERT_TRUE(table().move_to(90, {}));
  EXPECT_EQ(runs(), (std::vector<long>{100})) << "the play is taken up already";
  bench_.steps.clear();
  ASSERT_TRUE(table().move_to(45, {}));
  EXPECT_EQ(runs(), (std::vector<long>{-53, 3}));
  bench_.steps.clear();
  ASSERT_TRUE(table().move_to(45.9, {}));
  EXPECT_EQ(runs(), (std::vector<long>{1}));
  bench_.steps.clear();
  ASSERT_TRUE(table().move_to(45.9, {}));
  EXPECT_EQ(runs(), (std::vector<long>{}));
}

TEST_F(SteppedTurntableTest, TakesTheBacklashUpAfterAStopOnTheWayBack) {
  home();
  ASSERT_TRUE(table().move_to(90, {}));
  std::stop_source stop;
  bench_.steps.clear();
  bench_.before_step = [&](std::size_t made) {
    if (made == 30) stop.request_stop();
  };
  const auto moved = table().move_to(0, stop.get_token());
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().kind, ErrorKind::cancelled);
  const double stopped_deg = *table().angle_deg();
  EXPECT_NEAR(stopped_deg, 90 + 0.9 * static_cast<double>(bench_.position()), 1e-9);
  EXPECT_LT(bench_.position(), -30) << "slowed down";

  bench_.before_step = [](std::size_t) {};
  bench_.steps.clear();
  ASSERT_TRUE(table().move_to(stopped_deg + 0.9, {}));  // less than the play: back first
  EXPECT_EQ(runs(), (std::vector<long>{-2, 3}));
}

TEST_F(SteppedTurntableTest, ChoosesTheNearestTurnAndKeepsCountingExactly) {
  config_.limits.steps_per_turn = 401.7;  // gears
  home();
  // Ever onwards by a little less than half a turn: after 1000 moves no step is lost or gained.
  const double step_deg = config_.limits.step_deg();
  double asked_deg = 0.0;
  for (int i = 0; i < 1000; ++i) {
    asked_deg += 170.0;
    ASSERT_TRUE(table().move_to(wrapped_deg(asked_deg), {}));
    ASSERT_EQ(bench_.position(), std::lround(asked_deg / step_deg)) << i;
    ASSERT_LE(std::abs(turn_deg(*table().angle_deg(), asked_deg)), 0.5 * step_deg + 1e-9);
  }
}

TEST_F(SteppedTurntableTest, HalfATurnGoesCounterClockwise) {
  home();
  ASSERT_TRUE(table().move_to(180, {}));
  EXPECT_EQ(bench_.position(), 200);
  ASSERT_TRUE(table().move_to(0, {}));
  EXPECT_EQ(bench_.position(), 400);
}

TEST_F(SteppedTurntableTest, LateWakeUpsShiftTheRestAndNeverBurst) {
  home();
  const long late_before = table().diagnostics().late_steps;
  bench_.lateness = [](std::size_t made) {
    return made % 10 == 7 ? 25'000'000ns : std::chrono::nanoseconds{made * 1000};
  };
  ASSERT_TRUE(table().move_to(90, {}));
  const auto plan = plan_motion(100, config_.limits);
  ASSERT_EQ(bench_.steps.size(), plan.due.size());
  for (std::size_t i = 1; i < plan.due.size(); ++i) {
    const auto planned = plan.due[i] - plan.due[i - 1];
    const auto made = bench_.steps[i].at - bench_.steps[i - 1].at;
    ASSERT_EQ(made, planned + bench_.lateness(i)) << "step " << i;
  }
  const auto diagnostics = table().diagnostics();
  EXPECT_EQ(diagnostics.late_steps - late_before, 10);
  EXPECT_EQ(diagnostics.max_lateness, 25ms);
}

TEST_F(SteppedTurntableTest, StopsAtTheVeryNextStepWhenTheInterlockTrips) {
  home();
  bench_.before_step = [&](std::size_t made) {
    if (made == 50) latch_->trip("emergency stop pressed");
  };
  const auto moved = table().move_to(120, {});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().message(), HasSubstr("turntable: emergency stop pressed"));
  EXPECT_EQ(bench_.steps.size(), 50u);
  EXPECT_FALSE(bench_.current);
  EXPECT_FALSE(table().angle_deg());
}

TEST_F(SteppedTurntableTest, NoticesATripThatWasResetInTheMeantime) {
  home();
  bench_.before_step = [&](std::size_t made) {
    if (made != 50) return;
    latch_->trip("emergency stop pressed");
    ASSERT_TRUE(latch_->reset());
  };
  const auto moved = table().move_to(120, {});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().message(), HasSubstr("stopped by the interlock"));
  EXPECT_EQ(bench_.steps.size(), 50u);
  EXPECT_FALSE(table().angle_deg());
}

TEST_F(SteppedTurntableTest, SelfHoldingGearKeepsThePositionAtRestButNotInMotion) {
  config_.holds_without_current = true;
  home();
  ASSERT_TRUE(table().move_to(90, {}));
  latch_->trip("door open");
  ASSERT_TRUE(latch_->reset());
  EXPECT_NEAR(*table().angle_deg(), 90, 1e-9);
  ASSERT_TRUE(table().release());
  EXPECT_NEAR(*table().angle_deg(), 90, 1e-9);
  bench_.steps.clear();
  ASSERT_TRUE(table().move_to(99, {}));
  EXPECT_EQ(bench_.position(), 10);
  bench_.before_step = [&](std::size_t made) {
    if (made == 30) latch_->trip("door open");
  };
  EXPECT_FALSE(table().move_to(180, {}));
  EXPECT_FALSE(table().angle_deg());
}

TEST_F(SteppedTurntableTest, LosesThePositionWithADriverThatFails) {
  home();
  bench_.breaks_at = 20;
  const auto moved = table().move_to(90, {});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().message(), "step line: broke");
  EXPECT_FALSE(table().angle_deg());
  EXPECT_FALSE(bench_.current);
}

TEST_F(SteppedTurntableTest, TellsWhyItIsNotRealTime) {
  bench_.real_time_refused = true;
  home();
  EXPECT_EQ(table().diagnostics().not_real_time, "stepping: refused");
}

TEST_F(SteppedTurntableTest, ZeroIsTheEdgeSeenCounterClockwisePlusTheOffset) {
  // The first closed position is 112: 0.9 * 112 = 100.8.
  for (const double offset_deg : {0.0, 45.0, -45.0}) {
    config_.home_offset_deg = offset_deg;
    ASSERT_TRUE(table().home({}));
    const long zero = 112 + std::lround(offset_deg / 0.9);
    EXPECT_EQ((bench_.position() % 400 + 400) % 400, zero);
    EXPECT_EQ(table().angle_deg(), 0.0);
    TearDown();
    bench_.steps.clear();
  }
}

TEST_F(SteppedTurntableTest, HomesWhenItStandsOnTheSwitchAndPastANarrowFlag) {
  bench_.index = [](long position) {
    return wrapped_deg(static_cast<double>(position) * 0.9 + 3.0) < 6.0;
  };
  ASSERT_TRUE(table().home({}));
  EXPECT_EQ(bench_.position(), -3);
  bench_.steps.clear();
  bench_.index = [](long position) { return ((position - 60) % 400 + 400) % 400 < 2; };
  ASSERT_TRUE(table().home({}));
  EXPECT_EQ(bench_.position(), 60);
}

TEST_F(SteppedTurntableTest, SaysWhatIsWrongWithTheIndexSwitch) {
  const auto message = [&] {
    const auto homed = table().home({});
    EXPECT_FALSE(bench_.current);
    EXPECT_FALSE(table().angle_deg());
    return homed ? std::string("homed") : homed.error().message();
  };
  bench_.index = [](long) { return false; };
  EXPECT_THAT(message(), HasSubstr("index switch never seen in 400 deg"));
  bench_.index = [](long) { return true; };
  EXPECT_THAT(message(), HasSubstr("index switch stays closed"));
  int reads = 0;
  bench_.index = [&](long) { return ++reads == 40; };  // a glitch
  EXPECT_THAT(message(), HasSubstr("seen once, but not again"));
}

TEST_F(SteppedTurntableTest, ApproachesTheEdgeSlowlyTheSecondTime) {
  std::vector<double> speeds_deg_s;
  ASSERT_TRUE(table().home({}));
  for (std::size_t i = 1; i < bench_.steps.size(); ++i) {
    const std::chrono::duration<double> gap = bench_.steps[i].at - bench_.steps[i - 1].at;
    if (bench_.steps[i].direction > 0) speeds_deg_s.push_back(0.9 / gap.count());
  }
  EXPECT_LT(std::ranges::max(speeds_deg_s), config_.home_speed_deg_s * 1.001);
  EXPECT_LT(speeds_deg_s.back(), config_.home_speed_deg_s * 0.126);
}

TEST(TurntableConfig, SaysWhichValueIsWrong) {
  const auto message = [](auto change) {
    TurntableConfig config;
    change(config);
    const auto ok = config.validate();
    return ok ? std::string("valid") : ok.error().message();
  };
  EXPECT_EQ(message([](TurntableConfig&) {}), "valid");
  EXPECT_EQ(message([](TurntableConfig& c) { c.backlash_deg = -1; }),
            "backlash_deg: is -1; 0 to 45 was expected");
  EXPECT_THAT(message([](TurntableConfig& c) { c.home_speed_deg_s = 0; }),
              HasSubstr("home_speed_deg_s: is 0"));
  EXPECT_THAT(message([](TurntableConfig& c) { c.home_search_deg = std::nan(""); }),
              HasSubstr("home_search_deg: is nan"));
  EXPECT_THAT(message([](TurntableConfig& c) { c.home_offset_deg = 400; }),
              HasSubstr("home_offset_deg: is 400"));
  EXPECT_THAT(message([](TurntableConfig& c) { c.limits.steps_per_turn = 0; }),
              HasSubstr("steps_per_turn: is 0"));
}

}  // namespace
}  // namespace skullstation
