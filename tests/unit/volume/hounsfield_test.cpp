#include "reconstruction/volume/hounsfield.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::grid_of;
using skullstation::testing::sampled;
using ::testing::HasSubstr;

Volume head(int shift) {
  return sampled(grid_of({20, 20, 20}, {10, 10, 10}),
                 [&](const Eigen::Vector3d& p) { return shift + (p.norm() < 70.0 ? 40 : -1000); });
}

TEST(Hounsfield, TheAirPeakIsFound) {
  ASSERT_TRUE(air_peak(head(0)));
  EXPECT_NEAR(*air_peak(head(0)), -1000, 4);
  EXPECT_NEAR(*air_peak(head(1024)), 24, 4);
  Volume padded = head(0);
  for (std::size_t i = 0; i < padded.hu.size() / 10; ++i) padded.hu[i] = -3024;
  EXPECT_NEAR(*air_peak(padded), -1000, 4);
  // Air stands to padding of -2000 as tissue stands to air.
  for (std::size_t i = 0; i < padded.hu.size() / 2; ++i) padded.hu[i] = -2000;
  EXPECT_NEAR(*air_peak(padded), -1000, 4);
  Volume water = head(0);
  std::ranges::fill(water.hu, std::int16_t{0});
  EXPECT_FALSE(air_peak(water));
}

TEST(Hounsfield, OffsetsAreAppliedOnRequestOnly) {
  Volume volume = head(1024);
  ASSERT_TRUE(apply_hu_offset(volume, {}, "a.nii"));
  EXPECT_EQ(volume.hu, head(1024).hu);
  VolumeReadOptions options;
  options.infer_hu_offset = true;
  ASSERT_TRUE(apply_hu_offset(volume, options, "a.nii"));
  EXPECT_EQ(volume.hu, head(0).hu);
  ASSERT_EQ(volume.info.warnings.size(), 1U);
  EXPECT_THAT(volume.info.warnings[0], HasSubstr("-1024 was inferred"));
  volume = head(5);
  options.hu_offset = -5;
  ASSERT_TRUE(apply_hu_offset(volume, options, "a.nii"));
  EXPECT_EQ(volume.hu, head(0).hu);
  EXPECT_THAT(volume.info.warnings[0], HasSubstr("-5 was added"));
}

TEST(Hounsfield, AnOffsetThatNobodyUsesIsNotInferred) {
  Volume volume = head(500);
  VolumeReadOptions options;
  options.infer_hu_offset = true;
  const auto applied = apply_hu_offset(volume, options, "a.nii");
  ASSERT_FALSE(applied);
  EXPECT_THAT(applied.error().message(), HasSubstr("--hu-offset N"));
}

}  // namespace
}  // namespace skullstation
