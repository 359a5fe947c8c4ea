#include "capture/scan/scan_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "core/units.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

ScanPlan plan_of(std::vector<SessionPlan::Ring> rings, int passes = 2) {
  ScanPlan plan;
  plan.rings = std::move(rings);
  plan.passes = passes;
  return plan;
}

TEST(ScanPlan, OneRingGoesOnceRoundWithoutTurningBack) {
  const std::vector<ScanStop> stops = stops_of_pass(plan_of({{"cam0", 48}}), 0);
  ASSERT_EQ(stops.size(), 48U);
  for (std::size_t i = 0; i < stops.size(); ++i) {
    EXPECT_DOUBLE_EQ(stops[i].table_angle_deg, 7.5 * static_cast<double>(i));
    ASSERT_EQ(stops[i].views.size(), 1U);
  }
  EXPECT_EQ(stops[7].views[0].image, "images/p0_c0_007.png");
}

TEST(ScanPlan, AllCamerasWithAViewAtAStopShareIt) {
  const std::vector<ScanStop> stops = stops_of_pass(plan_of({{"low", 6}, {"high", 3}}), 1);
  ASSERT_EQ(stops.size(), 6U);
  for (std::size_t i = 0; i < stops.size(); ++i) {
    EXPECT_EQ(stops[i].views.size(), i % 2 == 0 ? 2U : 1U) << i;
  }
  EXPECT_EQ(stops[2].views[0].image, "images/p1_c0_002.png");
  EXPECT_EQ(stops[2].views[1].image, "images/p1_c1_001.png");
  EXPECT_EQ(stops[2].views[1].ring, 1);
}

TEST(ScanPlan, RingsThatShareNoAngleButZeroStillGoOnceRound) {
  const std::vector<ScanStop> stops = stops_of_pass(plan_of({{"a", 7}, {"b", 48}, {"c", 49}}), 0);
  double turned_deg = 0.0;
  int views = 0;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    if (i > 0) {
      const double step = turn_deg(stops[i - 1].table_angle_deg, stops[i].table_angle_deg);
      EXPECT_GT(step, 0.0);
      turned_deg += step;
    }
    views += static_cast<int>(stops[i].views.size());
  }
  EXPECT_LT(turned_deg, 360.0);
  EXPECT_EQ(views, 7 + 48 + 49);
  // 360 k / 7 = 360 m / 49 for m = 7 k: these are one stop, whatever the rounding.
  EXPECT_EQ(stops.size(), 7 + 48 + 49 - 2 - 6U);
}

TEST(ScanPlan, EveryViewIsPlannedOnceUnderANameOfItsOwn) {
  ScanPlan plan = plan_of({{"a", 48}, {"b", 24}}, 3);
  plan.image_format = PhotographFormat::jpeg;
  const std::vector<PlannedView> views = planned_views(plan);
  EXPECT_EQ(views.size(), 3U * 72U);
  std::set<std::string> names;
  std::set<std::tuple<int, int, double>> places;
  for (const PlannedView& view : views) {
    EXPECT_TRUE(names.insert(view.image).second) << view.image;
    EXPECT_TRUE(places.insert({view.pass, view.ring, view.table_angle_deg}).second) << view.image;
    EXPECT_TRUE(view.image.ends_with(".jpg"));
  }
}

TEST(ScanPlan, SenselessPlansAreUsageErrors) {
  ScanPlan jpeg = plan_of({{"a", 8}});
  jpeg.jpeg_quality = 0;
  const std::pair<ScanPlan, const char*> cases[] = {
      {plan_of({}), "rings: there is none"},
      {plan_of({{"", 8}}), "a ring has no camera"},
      {plan_of({{"a", 8}, {"a", 8}}), "camera \"a\" has two rings"},
      {plan_of({{"a", 0}}), "must be from 1 to 1000 a ring, not 0"},
      {plan_of({{"a", 1001}}), "not 1001"},
      {plan_of({{"a", 8}}, 0), "passes: must be from 1 to 10, not 0"},
      {plan_of({{"a", 8}}, 11), "passes: must be from 1 to 10, not 11"},
      {jpeg, "jpeg_quality: must be from 1 to 100, not 0"},
  };
  for (const auto& [plan, expected] : cases) {
    const Result<void> valid = plan.validate();
    ASSERT_FALSE(valid) << expected;
    EXPECT_EQ(valid.error().kind, ErrorKind::usage);
    EXPECT_THAT(valid.error().message(), HasSubstr(expected));
  }
  EXPECT_TRUE(plan_of({{"a", 1}, {"b", 1000}}, 10).validate());
}

}  // namespace
}  // namespace skullstation
