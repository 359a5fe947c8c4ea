#include "reconstruction/volume/stack_resampling.h"

#include <gtest/gtest.h>

#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::grid_of;

/// A smooth ball in air.
double ball(const Eigen::Vector3d& p) {
  return -1000.0 + 1100.0 * std::exp(-p.squaredNorm() / 150.0);
}

double largest_error_hu(const Volume& volume, int border) {
  double largest = 0.0;
  const VoxelGrid& grid = volume.grid;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = border; j < grid.size.y() - border; ++j) {
      for (int i = border; i < grid.size.x() - border; ++i) {
        const auto point = grid.patient_from_voxel(Eigen::Vector3i(i, j, k).cast<double>());
        largest = std::max(largest, std::abs(volume.at(i, j, k) - ball(point)));
      }
    }
  }
  return largest;
}

TEST(StackResampling, ATiltedGantryIsUndone) {
  const VoxelGrid grid = grid_of({80, 80, 41}, {1.0, 1.0, 2.0});
  SliceStack stack;
  const double slope = std::tan(radians(18.0));
  Volume tilted;
  tilted.grid = grid;
  tilted.hu.resize(grid.count());
  for (int k = 0; k < grid.size.z(); ++k) {
    const Eigen::Vector2d drift_mm(0.0, 2.0 * slope * (k - 20));
    stack.drift_mm.push_back(drift_mm);
    for (int j = 0; j < 80; ++j) {
      for (int i = 0; i < 80; ++i) {
        Eigen::Vector3d point = grid.patient_from_voxel(Eigen::Vector3i(i, j, k).cast<double>());
        point.y() += drift_mm.y();
        tilted.at(i, j, k) = static_cast<std::int16_t>(std::lround(ball(point)));
      }
    }
  }
  const Volume straight = straightened(tilted, stack);
  EXPECT_EQ(straight.grid.size.x(), 80);
  EXPECT_GT(straight.grid.size.y(), 100);
  EXPECT_LT(largest_error_hu(straight, 8), 2.0);
}

TEST(StackResampling, UnevenSlicesAreInterpolatedAtTheSmallestGap) {
  SliceStack stack;
  stack.height_mm = {0, 1, 2, 4, 6};
  stack.smallest_gap_mm = 1.0;
  Volume volume;
  volume.grid.size = {2, 2, 5};
  for (const double z : stack.height_mm) {
    for (int i = 0; i < 4; ++i) volume.hu.push_back(static_cast<std::int16_t>(10 * z + i));
  }
  const Volume even = evenly_spaced(volume, stack);
  ASSERT_EQ(even.grid.size.z(), 7);
  EXPECT_EQ(even.grid.spacing_mm.z(), 1.0);
  for (int k = 0; k < 7; ++k) EXPECT_EQ(even.at(1, 1, k), 10 * k + 3);
}

}  // namespace
}  // namespace skullstation
