#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skullstation {
namespace {

TEST(Random, TheStreamIsTheSameEverywhere) {
  // splitmix64's published first outputs for seed 0 (Steele et al. 2014, reference code).
  Random random(0);
  EXPECT_EQ(random.bits(), 0xe220a8397b1dcdafULL);
  EXPECT_EQ(random.bits(), 0x6e789e6aa1b965f4ULL);
}

TEST(Random, MomentsOfTheNormalDistribution) {
  Random random(7);
  const int n = 200000;
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal(3.0, 2.0);
    sum += x;
    squares += (x - 3.0) * (x - 3.0);
  }
  EXPECT_NEAR(sum / n, 3.0, 5.0 * 2.0 / std::sqrt(n));  // five standard errors
  EXPECT_NEAR(squares / n, 4.0, 5.0 * 4.0 * std::sqrt(2.0 / n));
}

TEST(Random, BelowStaysBelowAndReachesEverything) {
  Random random(1);
  int counts[3] = {0, 0, 0};
  for (int i = 0; i < 3000; ++i) ++counts[random.below(3)];
  for (const int count : counts) EXPECT_NEAR(count, 1000, 5 * 26);  // five binomial SDs
}

TEST(Random, UniformStaysInRange) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const double x = random.uniform(-2.0, 5.0);
    EXPECT_GE(x, -2.0);
    EXPECT_LT(x, 5.0);
  }
}

}  // namespace
}  // namespace skullstation
