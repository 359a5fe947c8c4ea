#include "reconstruction/volume/skull_field.h"

#include <algorithm>

#include "core/parallel.h"
#include "reconstruction/volume/morphology.h"

namespace skullstation {

std::vector<std::int16_t> skull_field(const Volume& volume, const VoxelMask& skull, int bone_hu,
                                      int threads) {
  const VoxelMask outside = reachable_from_outside(skull);
  const auto removed_hu = static_cast<std::int16_t>(std::max(bone_hu - 600, -1000));
  const auto filled_hu = static_cast<std::int16_t>(bone_hu + 400);
  std::vector<std::int16_t> hu(volume.hu.size());
  const std::size_t slice_size = static_cast<std::size_t>(volume.grid.size.x()) *
                                 static_cast<std::size_t>(volume.grid.size.y());
  parallel_for(volume.grid.size.z(), threads, [&](int k) {
    const std::size_t first = static_cast<std::size_t>(k) * slice_size;
    for (std::size_t v = first; v < first + slice_size; ++v) {
      if (skull.on[v] != 0) {
        hu[v] = std::max(volume.hu[v], static_cast<std::int16_t>(bone_hu));
      } else if (outside.on[v] == 0) {
        hu[v] = filled_hu;
      } else {
        hu[v] = volume.hu[v] >= bone_hu ? removed_hu : volume.hu[v];
      }
    }
  });
  return hu;
}

}  // namespace skullstation
