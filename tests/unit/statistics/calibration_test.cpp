#include "reconstruction/statistics/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace skullstation {
namespace {

TEST(ConformalFactor, IsTheRankThatHoldsTheShare) {
  const std::vector<double> ratios = {0.9, 0.1, 0.5, 0.3, 0.7, 0.2, 0.4, 0.8, 0.6};
  // ceil(10 * 0.8) = 8th of 9.
  EXPECT_DOUBLE_EQ(conformal_factor(ratios, 0.8).value(), 0.8);
  EXPECT_DOUBLE_EQ(conformal_factor(ratios, 0.5).value(), 0.5);
  // Nine errors can't tell the 99 % band: the greatest is all there is.
  EXPECT_DOUBLE_EQ(conformal_factor(ratios, 0.99).value(), 0.9);
}

TEST(ConformalFactor, NewErrorsLieInsideAsOftenAsPromised) {
  Random random(3);
  const auto draw = [&](int count) {
    std::vector<double> ratios;
    // Heavy tails, and predicted deviations that are too small by half.
    for (int i = 0; i < count; ++i) {
      ratios.push_back(2.0 * std::abs(random.normal()) / (0.3 + random.uniform()));
    }
    return ratios;
  };
  const double factor = conformal_factor(draw(4000), 0.8).value();
  EXPECT_NEAR(coverage_of(draw(4000), factor).share, 0.8, 0.02);
}

TEST(ConformalFactor, RefusesNothingAndImpossibleLevels) {
  EXPECT_EQ(conformal_factor({}, 0.8).error().kind, ErrorKind::bad_input);
  const std::vector<double> one = {1.0};
  EXPECT_THAT(conformal_factor(one, 1.0).error().what, ::testing::HasSubstr("between 0 and 1"));
}

TEST(BandCoverage, HasWilsonsInterval) {
  std::vector<double> ratios(100, 2.0);
  std::fill_n(ratios.begin(), 80, 0.5);
  const BandCoverage coverage = coverage_of(ratios, 1.0);
  EXPECT_DOUBLE_EQ(coverage.share, 0.8);
  // Wilson 1927 for 80 of 100.
  EXPECT_NEAR(coverage.low, 0.7112, 1e-4);
  EXPECT_NEAR(coverage.high, 0.8666, 1e-4);
  EXPECT_EQ(coverage_of({}, 1.0).high, 1.0);
}

}  // namespace
}  // namespace skullstation
