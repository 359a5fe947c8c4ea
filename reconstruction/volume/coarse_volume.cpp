#include "reconstruction/volume/coarse_volume.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace skullstation {

VoxelMask CoarseVolume::at_least(int hu_threshold) const {
  VoxelMask mask(grid.size);
  std::transform(hu.begin(), hu.end(), mask.on.begin(),
                 [&](std::int16_t value) -> std::uint8_t { return value >= hu_threshold ? 1 : 0; });
  return mask;
}

CoarseVolume coarse_volume(const Volume& volume, double voxel_mm, int threads) {
  CoarseVolume coarse;
  coarse.grid = volume.grid;
  for (int a = 0; a < 3; ++a) {
    coarse.block[a] =
        std::max(1, static_cast<int>(std::lround(voxel_mm / volume.grid.spacing_mm[a])));
    coarse.grid.size[a] = (volume.grid.size[a] + coarse.block[a] - 1) / coarse.block[a];
    coarse.grid.spacing_mm[a] = volume.grid.spacing_mm[a] * coarse.block[a];
  }
  const Eigen::Vector3d middle = 0.5 * (coarse.block - Eigen::Vector3i::Ones()).cast<double>();
  coarse.grid.origin_mm = volume.grid.patient_from_voxel(middle);
  coarse.hu.resize(coarse.grid.count());
  const auto width = static_cast<std::size_t>(coarse.grid.size.x());
  parallel_for(coarse.grid.size.z(), threads, [&](int k) {
    const Eigen::Vector3i& block = coarse.block;
    const int k_end = std::min((k + 1) * block.z(), volume.grid.size.z());
    std::vector<int> sum(width);
    std::vector<int> count(width);
    for (int j = 0; j < coarse.grid.size.y(); ++j) {
      std::ranges::fill(sum, 0);
      std::ranges::fill(count, 0);
      const int j_end = std::min((j + 1) * block.y(), volume.grid.size.y());
      for (int fine_k = k * block.z(); fine_k < k_end; ++fine_k) {
        for (int fine_j = j * block.y(); fine_j < j_end; ++fine_j) {
          const std::int16_t* row = volume.hu.data() + volume.grid.index(0, fine_j, fine_k);
          for (std::size_t i = 0; i < width; ++i) {
            const int end = std::min((static_cast<int>(i) + 1) * block.x(), volume.grid.size.x());
            for (int fine_i = static_cast<int>(i) * block.x(); fine_i < end; ++fine_i) {
              sum[i] += row[fine_i];
              ++count[i];
            }
          }
        }
      }
      std::int16_t* to = coarse.hu.data() + coarse.grid.index(0, j, k);
      for (std::size_t i = 0; i < width; ++i) to[i] = static_cast<std::int16_t>(sum[i] / count[i]);
    }
  });
  return coarse;
}

}  // namespace skullstation
