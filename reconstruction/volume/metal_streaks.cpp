#include "reconstruction/volume/metal_streaks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/parallel.h"
#include "reconstruction/volume/morphology.h"

namespace skullstation {

namespace {

constexpr double least_metal_mm2 = 15.0;
constexpr double rougher_than_sound = 1.15;
constexpr double streak_length_mm = 45.0;
constexpr double widest_gap_mm = 5.0;
constexpr double bone_slope = 0.1;  // how far bone may lean over on its way from a sound slice
constexpr int soft_from_hu = -200;
constexpr int soft_to_hu = 400;

struct SliceTexture {
  double metal_mm2 = 0.0;
  double roughness_hu = 0.0;  // mean step between neighbouring soft voxels
};

SliceTexture texture_of(const Volume& volume, int metal_hu, int k) {
  const VoxelGrid& grid = volume.grid;
  SliceTexture texture;
  double steps = 0.0;
  double pairs = 0.0;
  for (int j = 0; j < grid.size.y(); ++j) {
    const std::int16_t* row = volume.hu.data() + grid.index(0, j, k);
    for (int i = 0; i + 1 < grid.size.x(); ++i) {
      if (row[i] >= metal_hu) texture.metal_mm2 += grid.spacing_mm.x() * grid.spacing_mm.y();
      const bool soft = row[i] >= soft_from_hu && row[i] <= soft_to_hu &&
                        row[i + 1] >= soft_from_hu && row[i + 1] <= soft_to_hu;
      if (!soft) continue;
      steps += std::abs(row[i] - row[i + 1]);
      pairs += 1.0;
    }
  }
  if (pairs > 0.0) texture.roughness_hu = steps / pairs;
  return texture;
}

/// Slice k of a mask as a mask one voxel thick.
VoxelMask slice_of(const VoxelMask& mask, int k) {
  VoxelMask slice(Eigen::Vector3i(mask.size.x(), mask.size.y(), 1));
  std::copy_n(mask.on.begin() + static_cast<std::ptrdiff_t>(mask.index(0, 0, k)), slice.on.size(),
              slice.on.begin());
  return slice;
}

VoxelMask metal_near(const Volume& volume, int metal_hu, const StreakedSlices& stack) {
  VoxelMask metal(Eigen::Vector3i(volume.grid.size.x(), volume.grid.size.y(), 1));
  for (int k = stack.first; k <= stack.last; ++k) {
    const std::size_t first = volume.grid.index(0, 0, k);
    for (std::size_t v = 0; v < metal.on.size(); ++v) {
      if (volume.hu[first + v] >= metal_hu) metal.on[v] = 1;
    }
  }
  return dilated(metal, streak_length_mm, volume.grid.spacing_mm, 1);
}

/// Distance to the outline [mm], negative inside.
std::vector<float> signed_outline_distance(const VoxelMask& slice,
                                           const Eigen::Vector3d& spacing_mm) {
  const auto outside = squared_distance_mm2(slice, spacing_mm, 1);
  const auto inside = squared_distance_mm2(inverted(slice), spacing_mm, 1);
  std::vector<float> distance(outside.size());
  for (std::size_t v = 0; v < distance.size(); ++v) {
    distance[v] = slice.on[v] != 0 ? -std::sqrt(inside[v]) : std::sqrt(outside[v]);
  }
  return distance;
}

}  // namespace

std::vector<StreakedSlices> find_streaks(const Volume& volume, int metal_hu, int threads) {
  const int slices = volume.grid.size.z();
  std::vector<SliceTexture> textures(static_cast<std::size_t>(slices));
  parallel_for(slices, threads, [&](int k) {
    textures[static_cast<std::size_t>(k)] = texture_of(volume, metal_hu, k);
  });
  const auto has_metal = [&](int k) {
    return textures[static_cast<std::size_t>(k)].metal_mm2 >= least_metal_mm2;
  };
  const auto roughness = [&](int k) { return textures[static_cast<std::size_t>(k)].roughness_hu; };
  // What the roughness would be without metal: interpolated between the nearest slices without.
  const auto usual = [&](int k) {
    int below = k;
    int above = k;
    while (below >= 0 && has_metal(below)) --below;
    while (above < slices && has_metal(above)) ++above;
    if (below < 0 && above >= slices) return 0.0;
    if (below < 0) return roughness(above);
    if (above >= slices) return roughness(below);
    const double t = static_cast<double>(k - below) / (above - below);
    return (1.0 - t) * roughness(below) + t * roughness(above);
  };
  std::vector<StreakedSlices> streaks;
  for (int k = 0; k < slices; ++k) {
    if (!has_metal(k) || roughness(k) < rougher_than_sound * usual(k)) continue;
    // Slices between two stacks near each other are no good measure for either.
    const double gap_mm =
        streaks.empty() ? 0.0 : (k - streaks.back().last - 1) * volume.grid.spacing_mm.z();
    if (streaks.empty() || gap_mm > widest_gap_mm) {
      streaks.push_back({k, k});
    } else {
      streaks.back().last = k;
    }
  }
  return streaks;
}

void remove_bone_streaks(const Volume& volume, int metal_hu,
                         const std::vector<StreakedSlices>& streaks, double longest_spike_mm,
                         VoxelMask& bone) {
  const Eigen::Vector3d& spacing_mm = volume.grid.spacing_mm;
  for (const StreakedSlices& stack : streaks) {
    const VoxelMask near_metal = metal_near(volume, metal_hu, stack);
    std::vector<std::pair<int, std::vector<float>>> sound;  // slice, mm^2 from its bone
    for (const int k : {stack.below(), stack.above()}) {
      if (k < 0 || k >= bone.size.z()) continue;
      sound.emplace_back(k, squared_distance_mm2(slice_of(bone, k), spacing_mm, 1));
    }
    for (int k = stack.first; k <= stack.last; ++k) {
      VoxelMask allowed(near_metal.size);
      for (const auto& [other, from_bone_mm2] : sound) {
        const double reach_mm =
            longest_spike_mm + bone_slope * std::abs(k - other) * spacing_mm.z();
        for (std::size_t v = 0; v < allowed.on.size(); ++v) {
          if (from_bone_mm2[v] <= reach_mm * reach_mm) allowed.on[v] = 1;
        }
      }
      std::uint8_t* slice = bone.on.data() + bone.index(0, 0, k);
      for (std::size_t v = 0; v < allowed.on.size(); ++v) {
        if (near_metal.on[v] != 0 && allowed.on[v] == 0) slice[v] = 0;
      }
    }
  }
}

void limit_skin_streaks(const Volume& volume, int metal_hu,
                        const std::vector<StreakedSlices>& streaks, double longest_spike_mm,
                        VoxelMask& solid) {
  const Eigen::Vector3d& spacing_mm = volume.grid.spacing_mm;
  const auto limit = static_cast<float>(longest_spike_mm);
  for (const StreakedSlices& stack : streaks) {
    const int below = std::max(stack.below(), 0);
    const int above = std::min(stack.above(), solid.size.z() - 1);
    const auto distance_below = signed_outline_distance(slice_of(solid, below), spacing_mm);
    const auto distance_above = signed_outline_distance(slice_of(solid, above), spacing_mm);
    const VoxelMask near_metal = metal_near(volume, metal_hu, stack);
    for (int k = stack.first; k <= stack.last; ++k) {
      const auto t = static_cast<float>(k - below) / static_cast<float>(std::max(1, above - below));
      std::uint8_t* slice = solid.on.data() + solid.index(0, 0, k);
      for (std::size_t v = 0; v < near_metal.on.size(); ++v) {
        if (near_metal.on[v] == 0) continue;
        const float distance = (1.0F - t) * distance_below[v] + t * distance_above[v];
        if (distance > limit) slice[v] = 0;
        if (distance < -limit) slice[v] = 1;
      }
    }
  }
}

}  // namespace skullstation
