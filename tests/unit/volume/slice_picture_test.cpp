#include "reconstruction/volume/slice_picture.h"

#include <gtest/gtest.h>

#include <array>

#include "reconstruction/volume/isosurface.h"
#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::sampled;

/// Brightness grows to the left, backwards or upwards by 100 HU a mm; voxels of 1 x 2 x 4 mm.
Volume ramp(int axis) {
  VoxelGrid grid;
  grid.size = {41, 21, 11};
  grid.spacing_mm = {1.0, 2.0, 4.0};
  grid.origin_mm = {-20.0, -20.0, -20.0};
  return sampled(grid, [&](const Eigen::Vector3d& p) { return 50.0 * p[axis]; });
}

TEST(SlicePicture, LiesAsRadiologistsLookAtIt) {
  SlicePictureOptions options;
  options.pixel_mm = 1.0;
  options.black_hu = -1000;
  options.white_hu = 1000;
  const auto grey = [&](int ramp_axis, int axis, int x, int y) {
    return static_cast<int>(slice_picture(ramp(ramp_axis), {axis, 5}, {}, options).at(x, y, 0));
  };
  const Image8 axial = slice_picture(ramp(0), {2, 5}, {}, options);
  EXPECT_EQ(axial.width, 41);
  EXPECT_EQ(axial.height, 42);
  EXPECT_EQ(slice_picture(ramp(0), {1, 5}, {}, options).height, 44);
  EXPECT_EQ(slice_picture(ramp(0), {0, 5}, {}, options).width, 42);
  EXPECT_GT(grey(0, 2, 35, 20), grey(0, 2, 5, 20)) << "axial: the patient's left is on the right";
  EXPECT_GT(grey(1, 2, 20, 35), grey(1, 2, 20, 5)) << "axial: the back is below";
  EXPECT_GT(grey(0, 1, 35, 20), grey(0, 1, 5, 20)) << "coronal: the left is on the right";
  EXPECT_GT(grey(2, 1, 20, 5), grey(2, 1, 20, 35)) << "coronal: the top is above";
  EXPECT_GT(grey(1, 0, 35, 20), grey(1, 0, 5, 20)) << "sagittal: the back is on the right";
  EXPECT_GT(grey(2, 0, 20, 5), grey(2, 0, 20, 35)) << "sagittal: the top is above";
  EXPECT_NEAR(grey(0, 2, 20, 20), 128, 2) << "0 HU in the middle";
}

TEST(SlicePicture, ASurfaceIsDrawnWhereItCutsTheSlice) {
  VoxelGrid grid;
  grid.size = {61, 61, 31};
  grid.spacing_mm = {1.0, 1.0, 2.0};
  grid.origin_mm = {-30.0, -30.0, -30.0};
  const Volume ball = sampled(grid, [](const Eigen::Vector3d& p) {
    return 100.0 * std::clamp(20.0 - p.norm(), -8.0, 8.0);
  });
  const TriangleMesh surface = isosurface(ball.grid, ball.hu, 0.0, 1);
  const std::array<SliceOutline, 1> outlines = {{{&surface, {1.0, 0.0, 0.0}}}};
  for (const int axis : {0, 1, 2}) {
    SlicePictureOptions options;
    options.black_hu = 5000;  // all black but the outline
    options.white_hu = 6000;
    const Image8 picture = slice_picture(ball, {axis, axis == 2 ? 15 : 30}, outlines, options);
    double farthest = 0.0;
    double nearest = 1e9;
    int drawn = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        if (picture.at(x, y, 0) < 128) continue;
        EXPECT_EQ(picture.at(x, y, 1), 0);
        ++drawn;
        const double radius_mm =
            0.5 * std::hypot(x + 0.5 - 0.5 * picture.width, y + 0.5 - 0.5 * picture.height);
        farthest = std::max(farthest, radius_mm);
        nearest = std::min(nearest, radius_mm);
      }
    }
    EXPECT_GT(drawn, 200) << axis;
    EXPECT_GT(nearest, 19.0) << axis;
    EXPECT_LT(farthest, 21.0) << axis;
  }
}

}  // namespace
}  // namespace skullstation
