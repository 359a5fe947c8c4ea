#include "firmware_io/motion_plan.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace skullstation {
namespace {

using std::chrono::nanoseconds;

double seconds(nanoseconds time) { return static_cast<double>(time.count()) * 1e-9; }

/// Speed, acceleration and jerk as differences of the due times say: each is the mean of the true
/// value over the steps it spans, so none may exceed its limit. Rounding to 1 ns is allowed for.
void expect_within_limits(const MotionPlan& plan, const MotionLimits& limits) {
  const double step_deg = limits.step_deg();
  const std::size_t count = plan.due.size();
  const std::size_t stride = std::max<std::size_t>(1, count / 200);
  const auto t = [&](std::size_t i) { return seconds(plan.due[i]); };
  const double span_deg = static_cast<double>(stride) * step_deg;
  for (std::size_t i = 0; i + stride < count; ++i) {
    const double speed = span_deg / (t(i + stride) - t(i));
    ASSERT_LT(speed, limits.max_speed_deg_s * (1 + 1e-4)) << "step " << i;
  }
  const auto divided = [&](std::size_t i, int order) {
    std::vector<double> difference;
    for (int k = 0; k <= order; ++k) difference.push_back(span_deg * k);
    for (int level = 1; level <= order; ++level) {
      for (int k = order; k >= level; --k) {
        difference[k] =
            (difference[k] - difference[k - 1]) / (t(i + k * stride) - t(i + (k - level) * stride));
      }
    }
    return difference[order];
  };
  for (std::size_t i = 0; i + 3 * stride < count; ++i) {
    const double dt = t(i + stride) - t(i);
    const double rounding_deg = limits.max_speed_deg_s * 4e-9;
    ASSERT_LT(std::abs(2 * divided(i, 2)),
              limits.max_acceleration_deg_s2 * (1 + 1e-4) + rounding_deg / (dt * dt))
        << "step " << i;
    ASSERT_LT(std::abs(6 * divided(i, 3)),
              limits.max_jerk_deg_s3 * (1 + 1e-4) + 4 * rounding_deg / (dt * dt * dt))
        << "step " << i;
  }
}

void expect_sound(const MotionPlan& plan, const MotionLimits& limits) {
  ASSERT_FALSE(plan.due.empty());
  ASSERT_GT(plan.due.front().count(), 0);
  ASSERT_EQ(std::ranges::adjacent_find(plan.due, std::greater_equal<>{}), plan.due.end());
  expect_within_limits(plan, limits);
}

TEST(MotionPlan, HasOneDueTimePerStepAndTheSignAsDirection) {
  const MotionLimits limits;
  EXPECT_EQ(plan_motion(400, limits).due.size(), 400u);
  EXPECT_EQ(plan_motion(400, limits).direction, 1);
  EXPECT_EQ(plan_motion(-400, limits).due, plan_motion(400, limits).due);
  EXPECT_EQ(plan_motion(-400, limits).direction, -1);
  EXPECT_TRUE(plan_motion(0, limits).due.empty());
  EXPECT_EQ(plan_motion(0, limits).duration(), nanoseconds{0});
}

TEST(MotionPlan, OneStepFallsInTheMiddleOfItsMotion) {
  // Distance d with jerk alone takes 4 (d / 2j)^(1/3).
  const MotionLimits limits;
  const auto plan = plan_motion(1, limits);
  ASSERT_EQ(plan.due.size(), 1u);
  const double duration_s = 4 * std::cbrt(limits.step_deg() / (2 * limits.max_jerk_deg_s3));
  EXPECT_NEAR(seconds(plan.due[0]), duration_s / 2, 1e-9);
}

TEST(MotionPlan, TakesTheLeastTime) {
  // v = 30, a = 60, j = 240: a ramp lasts v/a + a/j = 0.75 s and turns 11.25 deg; a whole turn is
  // two ramps and 337.5 deg at full speed: 12.75 s. First and last step are half a step inside.
  const MotionLimits limits;
  const auto plan = plan_motion(6400, limits);
  const double half_step_s = std::cbrt(6 * 0.5 * limits.step_deg() / limits.max_jerk_deg_s3);
  EXPECT_NEAR(seconds(plan.due.front()), half_step_s, 1e-9);
  EXPECT_NEAR(seconds(plan.due.back()), 12.75 - half_step_s, 2e-9);
  EXPECT_NEAR(seconds(plan.due[3200] - plan.due[3199]), limits.step_deg() / 30.0, 2e-9);
}

TEST(MotionPlan, ReachesFullAccelerationButNotFullSpeed) {
  // 9 deg: ramp time T solves 60 T (T - 0.25) = 9, T = (0.25 + sqrt(0.0625 + 0.6)) / 2.
  const MotionLimits limits;
  const auto plan = plan_motion(160, limits);
  const double ramp_s = 0.5 * (0.25 + std::sqrt(0.0625 + 0.6));
  EXPECT_NEAR(seconds(plan.due.front() + plan.due.back()), 2 * ramp_s, 2e-9);
  expect_sound(plan, limits);
}

TEST(MotionPlan, IsSymmetric) {
  for (const long steps : {1L, 2L, 3L, 17L, 400L, 6400L, 100'000L}) {
    const auto plan = plan_motion(steps, {});
    const nanoseconds whole = plan.due.front() + plan.due.back();
    for (std::size_t i = 0; i < plan.due.size(); ++i) {
      const auto mirrored = whole - plan.due[plan.due.size() - 1 - i];
      ASSERT_LE(std::abs((plan.due[i] - mirrored).count()), 2) << steps << " steps, step " << i;
    }
  }
}

TEST(MotionPlan, HugeMotionsStayExact) {
  const MotionLimits limits;
  const long turns = 100;
  const auto plan = plan_motion(turns * 6400, limits);
  ASSERT_EQ(plan.due.size(), 100u * 6400u);
  EXPECT_NEAR(seconds(plan.due.front() + plan.due.back()), 0.75 + turns * 12.0, 1e-8);
  expect_sound(plan, limits);
}

MotionLimits random_limits(Random& random) {
  const auto magnitude = [&](double low, double high) {
    return low * std::pow(high / low, random.uniform());
  };
  MotionLimits limits;
  limits.steps_per_turn = magnitude(200, 51'200);
  limits.max_speed_deg_s = magnitude(0.5, 360);
  limits.max_acceleration_deg_s2 = magnitude(1, 5000);
  limits.max_jerk_deg_s3 = magnitude(5, 100'000);
  return limits;
}

TEST(MotionPlan, KeepsRandomLimits) {
  Random random(7);
  for (int trial = 0; trial < 150; ++trial) {
    const MotionLimits limits = random_limits(random);
    ASSERT_TRUE(limits.validate());
    const long steps = 1 + static_cast<long>(std::pow(10.0, random.uniform(0, 4.3)));
    SCOPED_TRACE(testing::Message() << "trial " << trial << ", " << steps << " steps");
    const auto plan = plan_motion(steps, limits);
    ASSERT_EQ(plan.due.size(), static_cast<std::size_t>(steps));
    ASSERT_NO_FATAL_FAILURE(expect_sound(plan, limits));
  }
}

TEST(BrakedPlan, KeepsWhatWasMadeAndTheLimitsAndEndsEarlier) {
  Random random(8);
  for (int trial = 0; trial < 300; ++trial) {
    const MotionLimits limits = random_limits(random);
    const auto plan = plan_motion(2 + static_cast<long>(random.below(8000)), limits);
    const std::size_t done = random.below(plan.due.size() + 1);
    SCOPED_TRACE(testing::Message()
                 << "trial " << trial << ", " << done << " of " << plan.due.size());
    const auto stopped = braked(plan, done, limits);
    ASSERT_GE(stopped.due.size(), done);
    ASSERT_LE(stopped.due.size(), plan.due.size());
    ASSERT_LE(stopped.duration(), plan.duration() + nanoseconds{2});
    ASSERT_TRUE(std::equal(stopped.due.begin(), stopped.due.begin() + static_cast<long>(done),
                           plan.due.begin()));
    if (done == 0) continue;
    ASSERT_NO_FATAL_FAILURE(expect_sound(stopped, limits));
  }
}

TEST(BrakedPlan, StopsFromFullSpeedInTheLeastDistance) {
  MotionLimits limits;
  limits.max_speed_deg_s = 20;  // a slow-down lasts v/a + a/j = 0.5833 s and turns 5.8333 deg
  const auto plan = plan_motion(6400, limits);
  const auto stopped = braked(plan, 3200, limits);
  EXPECT_EQ(stopped.due.size(), 3200u + 103u);
  const double last_stretch_deg = 5.0 / 6.0 + 5.0 - 103 * limits.step_deg();
  const double last_stretch_s = std::cbrt(6 * last_stretch_deg / limits.max_jerk_deg_s3);
  EXPECT_NEAR(seconds(stopped.duration() - plan.due[3199]), 0.58333333 - last_stretch_s, 1e-7);
}

TEST(BrakedPlan, DoesNothingAtRestAndEndsAsPlannedWhenSlowingDown) {
  const MotionLimits limits;
  const auto plan = plan_motion(1000, limits);
  EXPECT_TRUE(braked(plan, 0, limits).due.empty());
  EXPECT_EQ(braked(plan, 950, limits).due, plan.due);
  EXPECT_EQ(braked(plan, 1000, limits).due, plan.due);
}

TEST(MotionLimits, SayWhichOneIsWrong) {
  const auto message = [](auto change) {
    MotionLimits limits;
    change(limits);
    const auto ok = limits.validate();
    return ok ? std::string("valid") : ok.error().message();
  };
  using testing::HasSubstr;
  EXPECT_EQ(message([](MotionLimits&) {}), "valid");
  EXPECT_THAT(message([](MotionLimits& l) { l.steps_per_turn = 0; }),
              HasSubstr("steps_per_turn: is 0; a number above 0 was expected"));
  EXPECT_THAT(message([](MotionLimits& l) { l.max_speed_deg_s = -3; }),
              HasSubstr("max_speed_deg_s: is -3"));
  EXPECT_THAT(message([](MotionLimits& l) { l.max_acceleration_deg_s2 = std::nan(""); }),
              HasSubstr("max_acceleration_deg_s2: is nan"));
  EXPECT_THAT(message([](MotionLimits& l) { l.max_jerk_deg_s3 = INFINITY; }),
              HasSubstr("max_jerk_deg_s3: is inf"));
  EXPECT_THAT(message([](MotionLimits& l) { l.max_speed_deg_s = 36'000; }),
              HasSubstr("640000 steps/s"));
}

}  // namespace
}  // namespace skullstation
