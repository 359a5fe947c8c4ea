#include "reconstruction/volume/voxel_components.h"

#include <gtest/gtest.h>

#include <queue>

#include "core/random.h"

namespace skullstation {
namespace {

int neighbor_kind(int di, int dj, int dk) { return std::abs(di) + std::abs(dj) + std::abs(dk); }

/// Component sizes by breadth-first search, in the order of first voxels.
std::vector<std::size_t> sizes_by_search(const VoxelMask& mask, int farthest_kind) {
  std::vector<bool> seen(mask.on.size(), false);
  std::vector<std::size_t> sizes;
  const Eigen::Vector3i size = mask.size;
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) {
        if (!mask.at(i, j, k) || seen[mask.index(i, j, k)]) continue;
        sizes.push_back(0);
        std::queue<Eigen::Vector3i> open;
        open.push({i, j, k});
        seen[mask.index(i, j, k)] = true;
        while (!open.empty()) {
          const Eigen::Vector3i v = open.front();
          open.pop();
          ++sizes.back();
          for (int n = 0; n < 27; ++n) {
            const Eigen::Vector3i d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
            const Eigen::Vector3i w = v + d;
            if (neighbor_kind(d.x(), d.y(), d.z()) > farthest_kind) continue;
            if ((w.array() < 0).any() || (w.array() >= size.array()).any()) continue;
            if (!mask.at(w.x(), w.y(), w.z()) || seen[mask.index(w.x(), w.y(), w.z())]) continue;
            seen[mask.index(w.x(), w.y(), w.z())] = true;
            open.push(w);
          }
        }
      }
    }
  }
  return sizes;
}

TEST(VoxelComponents, AgreeWithASearchForEveryConnectivity) {
  Random random(5);
  for (const double share : {0.05, 0.15, 0.3, 0.6}) {
    VoxelMask mask({19, 11, 13});
    for (auto& on : mask.on) on = random.uniform() < share ? 1 : 0;
    const std::array kinds = {std::pair{Connectivity::face6, 1}, std::pair{Connectivity::edge18, 2},
                              std::pair{Connectivity::corner26, 3}};
    for (const auto& [connectivity, farthest] : kinds) {
      const VoxelComponents components(mask, connectivity);
      std::vector<std::size_t> sizes;
      for (const auto& component : components.all()) sizes.push_back(component.voxels);
      EXPECT_EQ(sizes, sizes_by_search(mask, farthest)) << share << " " << farthest;
      for (int k = 0; k < 13; ++k) {
        for (int j = 0; j < 11; ++j) {
          for (int i = 0; i < 19; ++i) {
            EXPECT_EQ(components.at(i, j, k) >= 0, mask.at(i, j, k));
          }
        }
      }
    }
  }
}

TEST(VoxelComponents, KnowTheirBoxAndGiveTheirMask) {
  VoxelMask mask({6, 5, 4});
  mask.on[mask.index(1, 1, 1)] = 1;
  mask.on[mask.index(2, 1, 1)] = 1;
  mask.on[mask.index(2, 1, 2)] = 1;
  mask.on[mask.index(5, 4, 3)] = 1;
  const VoxelComponents components(mask, Connectivity::face6);
  ASSERT_EQ(components.all().size(), 2U);
  EXPECT_EQ(components.largest(), 0);
  EXPECT_EQ(components.all()[0].least, Eigen::Vector3i(1, 1, 1));
  EXPECT_EQ(components.all()[0].most, Eigen::Vector3i(2, 1, 2));
  const VoxelMask second = components.mask_of({false, true});
  EXPECT_TRUE(second.at(5, 4, 3));
  EXPECT_FALSE(second.at(1, 1, 1));
  EXPECT_EQ(VoxelComponents(VoxelMask({3, 3, 3}), Connectivity::face6).largest(), -1);
}

}  // namespace
}  // namespace skullstation
