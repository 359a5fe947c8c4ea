#include "reconstruction/volume/morphology.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "reconstruction/volume/opening_seal.h"

namespace skullstation {
namespace {

const Eigen::Vector3d spacing(0.5, 0.7, 1.5);

VoxelMask sparse(std::uint64_t seed) {
  VoxelMask mask({12, 9, 7});
  Random random(seed);
  for (auto& on : mask.on) on = random.uniform() < 0.02 ? 1 : 0;
  return mask;
}

template <class Work>
void for_voxels(const VoxelMask& mask, const Work& work) {
  for (int k = 0; k < mask.size.z(); ++k) {
    for (int j = 0; j < mask.size.y(); ++j) {
      for (int i = 0; i < mask.size.x(); ++i) work(i, j, k);
    }
  }
}

TEST(Morphology, DistancesAreThoseToTheNearestVoxel) {
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    const VoxelMask mask = sparse(seed);
    const auto distance = squared_distance_mm2(mask, spacing, 2);
    for_voxels(mask, [&](int i, int j, int k) {
      double least = std::numeric_limits<double>::infinity();
      for_voxels(mask, [&](int x, int y, int z) {
        if (!mask.at(x, y, z)) return;
        const Eigen::Vector3d step = Eigen::Vector3d(x - i, y - j, z - k).cwiseProduct(spacing);
        least = std::min(least, step.squaredNorm());
      });
      ASSERT_FLOAT_EQ(distance[mask.index(i, j, k)], static_cast<float>(least));
    });
  }
}

TEST(Morphology, AnEmptyMaskIsInfinitelyFar) {
  const auto distance = squared_distance_mm2(VoxelMask({3, 3, 3}), spacing, 1);
  for (const float d : distance) EXPECT_TRUE(std::isinf(d));
}

TEST(Morphology, ErosionUndoesDilationOfABall) {
  VoxelMask point({41, 41, 41});
  point.on[point.index(20, 20, 20)] = 1;
  const Eigen::Vector3d unit(1, 1, 1);
  const VoxelMask ball = dilated(point, 8.0, unit, 2);
  const VoxelMask wider = dilated(ball, 5.0, unit, 2);
  const VoxelMask back = eroded(wider, 5.0, unit, 2);
  for (std::size_t v = 0; v < ball.on.size(); ++v) EXPECT_GE(back.on[v], ball.on[v]);
  EXPECT_FALSE(back.at(20, 20, 30));
}

TEST(Morphology, InnerAirIsNotReachableAndTheLowestSliceIsNoDoor) {
  // A pot that is open below, and one open at the side.
  VoxelMask pots({20, 20, 12});
  for_voxels(pots, [&](int i, int j, int k) {
    const auto wall = [&](int middle) {
      const int x = std::abs(i - middle);
      const int y = std::abs(j - 10);
      return x <= 3 && y <= 3 && k <= 6 && (x == 3 || y == 3 || k == 6);
    };
    if (wall(5) || wall(14)) pots.on[pots.index(i, j, k)] = 1;
  });
  pots.on[pots.index(17, 10, 3)] = 0;
  const VoxelMask outside = reachable_from_outside(pots);
  EXPECT_FALSE(outside.at(5, 10, 0));
  EXPECT_FALSE(outside.at(5, 10, 3));
  EXPECT_TRUE(outside.at(14, 10, 3));
  EXPECT_TRUE(outside.at(0, 0, 0));
}

TEST(OpeningSeal, ATubeIsClosedBelowItsDepthAndADentIsNot) {
  // A block with a narrow tube that leads into a cave, and a wide dent.
  VoxelMask block({60, 50, 40});
  for_voxels(block, [&](int i, int j, int k) {
    const bool body = i >= 5 && i < 55 && j >= 10 && j < 45 && k >= 5 && k < 35;
    const bool tube = std::hypot(i - 15, k - 20) < 3.0 && j < 25;
    const bool cave = std::hypot(std::hypot(i - 17, k - 20), j - 30) < 8.0;
    const bool dent = std::hypot(std::hypot(i - 40, k - 20), j - 8) < 12.0;
    block.on[block.index(i, j, k)] = body && !tube && !cave && !dent ? 1 : 0;
  });
  const VoxelMask sealed = sealed_from_outside(block, {1, 1, 1}, {6.0, 6.0}, 2);
  EXPECT_TRUE(sealed.at(17, 30, 20)) << "the cave";
  EXPECT_TRUE(sealed.at(15, 20, 20)) << "deep in the tube";
  EXPECT_FALSE(sealed.at(15, 13, 20)) << "the mouth of the tube";
  EXPECT_FALSE(sealed.at(40, 18, 20)) << "the dent's ground";
  EXPECT_FALSE(sealed.at(1, 1, 1));
  EXPECT_TRUE(sealed.at(17, 39, 20)) << "the cave's wall";
  EXPECT_TRUE(sealed.at(30, 40, 20)) << "deep in the body";
}

TEST(OpeningSeal, AFurrowStaysOpenToItsGround) {
  VoxelMask block({60, 50, 40});
  for_voxels(block, [&](int i, int j, int k) {
    const bool body = i >= 5 && i < 55 && j >= 10 && j < 45 && k >= 5 && k < 35;
    const bool furrow = std::abs(i - 20) < 4 && j < 25;
    const bool canyon = std::abs(i - 40) < 4 && j < 42 && std::abs(k - 20) < 8;
    block.on[block.index(i, j, k)] = body && !furrow && !canyon ? 1 : 0;
  });
  const VoxelMask sealed = sealed_from_outside(block, {1, 1, 1}, {6.0, 6.0}, 2);
  EXPECT_FALSE(sealed.at(20, 24, 20)) << "the furrow's ground";
  EXPECT_TRUE(sealed.at(40, 41, 20)) << "the canyon's ground";
}

}  // namespace
}  // namespace skullstation
