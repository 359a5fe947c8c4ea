#include "reconstruction/volume/slice_stack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/units.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
const Eigen::Vector3d y = Eigen::Vector3d::UnitY();

std::vector<SlicePlace> slices_at(const std::vector<double>& heights, double drift_per_mm = 0.0) {
  std::vector<SlicePlace> slices;
  for (const double z : heights) {
    slices.push_back({{-100.0, -120.0 + drift_per_mm * z, z}, "slice " + std::to_string(z)});
  }
  return slices;
}

TEST(SliceStack, ShuffledSlicesAreSortedUpwards) {
  const auto stack = stack_slices(slices_at({4, 0, 2, 3, 1}), x, y);
  ASSERT_TRUE(stack) << stack.error().message();
  EXPECT_EQ(stack->order, (std::vector<int>{1, 4, 2, 3, 0}));
  EXPECT_DOUBLE_EQ(stack->spacing_mm, 1.0);
  EXPECT_FALSE(stack->uneven);
  EXPECT_EQ(stack->tilt_deg, 0.0);
}

TEST(SliceStack, RoundedPositionsAreEven) {
  const auto stack = stack_slices(slices_at({0, 0.63, 1.25, 1.88, 2.5, 3.13}), x, y);
  ASSERT_TRUE(stack) << stack.error().message();
  EXPECT_FALSE(stack->uneven);
  EXPECT_NEAR(stack->spacing_mm, 0.626, 1e-9);
}

TEST(SliceStack, AMissingSliceIsRefusedWithItsPosition) {
  const auto stack = stack_slices(slices_at({0, 1, 2, 3, 5, 6, 7, 8}), x, y);
  ASSERT_FALSE(stack);
  EXPECT_THAT(stack.error().message(), HasSubstr("a slice is missing above this one"));
  EXPECT_THAT(stack.error().message(), HasSubstr("(-100.00, -120.00, 4.00) mm"));
  EXPECT_THAT(stack.error().where, HasSubstr("slice 3"));
}

TEST(SliceStack, SeveralMissingInARowAreNamedToo) {
  const auto stack = stack_slices(slices_at({0, 1, 2, 3, 7, 8}), x, y);
  ASSERT_FALSE(stack);
  EXPECT_THAT(stack.error().message(), HasSubstr("slices are missing"));
}

TEST(SliceStack, UnevenGapsAreToldAndTooLargeOnesRefused) {
  const auto stack = stack_slices(slices_at({0, 1, 2, 3, 4, 6, 8, 10, 12}), x, y);
  ASSERT_TRUE(stack) << stack.error().message();
  EXPECT_TRUE(stack->uneven);
  EXPECT_DOUBLE_EQ(stack->smallest_gap_mm, 1.0);
  EXPECT_DOUBLE_EQ(stack->largest_gap_mm, 2.0);
  const auto coarse = stack_slices(slices_at({0, 1, 2, 3.5, 10.2, 17, 23}), x, y);
  ASSERT_FALSE(coarse);
  EXPECT_THAT(coarse.error().message(), HasSubstr("uneven gaps from 1.00 to 6.80 mm"));
}

TEST(SliceStack, TheTiltIsMeasured) {
  const auto stack = stack_slices(slices_at({0, 1, 2, 3}, std::tan(radians(15.0))), x, y);
  ASSERT_TRUE(stack) << stack.error().message();
  EXPECT_NEAR(stack->tilt_deg, 15.0, 1e-9);
  EXPECT_NEAR(stack->drift_mm[3].y(), 3.0 * std::tan(radians(15.0)), 1e-12);
}

TEST(SliceStack, DoubledSingleAndStrayingSlicesAreRefused) {
  const auto doubled = stack_slices(slices_at({0, 1, 1, 2}), x, y);
  ASSERT_FALSE(doubled);
  EXPECT_THAT(doubled.error().message(), HasSubstr("lies in the same place as"));
  EXPECT_THAT(stack_slices(slices_at({0}), x, y).error().message(), HasSubstr("at least 2 slices"));
  EXPECT_THAT(stack_slices({}, x, y).error().message(), HasSubstr("has 0"));
  auto straying = slices_at({0, 1, 2, 3});
  straying[2].position_mm.x() += 3.0;
  const auto stack = stack_slices(straying, x, y);
  ASSERT_FALSE(stack);
  EXPECT_THAT(stack.error().message(), HasSubstr("lies beside the line"));
}

}  // namespace
}  // namespace skullstation
