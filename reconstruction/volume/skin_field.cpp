#include "reconstruction/volume/skin_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "reconstruction/volume/morphology.h"

namespace skullstation {

namespace {

constexpr std::int16_t air_hu = -1000;
constexpr std::int16_t inside_hu = 600;  // as far above -200 as air lies below
constexpr double smoothing_mm = 1.5;

/// Calls `work(row begin index, j, k, coarse row begin)` for every row of the fine grid.
template <class Work>
void for_rows(const Volume& volume, const CoarseVolume& coarse, int threads, const Work& work) {
  parallel_for(volume.grid.size.z(), threads, [&](int k) {
    for (int j = 0; j < volume.grid.size.y(); ++j) {
      work(volume.grid.index(0, j, k),
           coarse.grid.index(0, j / coarse.block.y(), k / coarse.block.z()));
    }
  });
}

/// Tissue in coarse voxels of the head or next to them.
VoxelMask head_tissue(const Volume& volume, const CoarseVolume& coarse, const VoxelMask& head,
                      int tissue_hu, int threads) {
  const VoxelMask near =
      dilated(head, 1.01 * coarse.grid.spacing_mm.norm(), coarse.grid.spacing_mm, threads);
  VoxelMask tissue(volume.grid.size);
  for_rows(volume, coarse, threads, [&](std::size_t fine, std::size_t coarse_row) {
    for (int i = 0; i < volume.grid.size.x(); ++i) {
      const auto x = static_cast<std::size_t>(i);
      const bool allowed =
          near.on[coarse_row + x / static_cast<std::size_t>(coarse.block.x())] != 0;
      tissue.on[fine + x] = allowed && volume.hu[fine + x] >= tissue_hu ? 1 : 0;
    }
  });
  return tissue;
}

/// Coarse voxels of which at least half is on.
VoxelMask majority(const VoxelMask& mask, const Volume& volume, const CoarseVolume& coarse,
                   int threads) {
  VoxelMask result(coarse.grid.size);
  parallel_for(coarse.grid.size.z(), threads, [&](int k) {
    std::vector<int> on(static_cast<std::size_t>(coarse.grid.size.x()));
    for (int j = 0; j < coarse.grid.size.y(); ++j) {
      std::ranges::fill(on, 0);
      int rows = 0;
      const int k_end = std::min((k + 1) * coarse.block.z(), volume.grid.size.z());
      const int j_end = std::min((j + 1) * coarse.block.y(), volume.grid.size.y());
      for (int fine_k = k * coarse.block.z(); fine_k < k_end; ++fine_k) {
        for (int fine_j = j * coarse.block.y(); fine_j < j_end; ++fine_j) {
          const std::uint8_t* row = mask.on.data() + mask.index(0, fine_j, fine_k);
          for (int i = 0; i < mask.size.x(); ++i) {
            on[static_cast<std::size_t>(i / coarse.block.x())] += row[i];
          }
          ++rows;
        }
      }
      for (int i = 0; i < coarse.grid.size.x(); ++i) {
        const int width = std::min(coarse.block.x(), mask.size.x() - i * coarse.block.x());
        result.on[result.index(i, j, k)] =
            2 * on[static_cast<std::size_t>(i)] >= rows * width ? 1 : 0;
      }
    }
  });
  return result;
}

/// Everything that the outside air can't reach without entering sealed coarse voxels, as one body.
VoxelMask closed_body(const VoxelMask& solid, const VoxelMask& sealed, const Volume& volume,
                      const CoarseVolume& coarse, int threads) {
  VoxelMask barred = solid;
  for_rows(volume, coarse, threads, [&](std::size_t fine, std::size_t coarse_row) {
    for (int i = 0; i < volume.grid.size.x(); ++i) {
      const auto x = static_cast<std::size_t>(i);
      barred.on[fine + x] |= sealed.on[coarse_row + x / static_cast<std::size_t>(coarse.block.x())];
    }
  });
  const VoxelComponents bodies(inverted(reachable_from_outside(barred)), Connectivity::edge18);
  std::vector<bool> keep(bodies.all().size(), false);
  if (bodies.largest() >= 0) keep[static_cast<std::size_t>(bodies.largest())] = true;
  return bodies.mask_of(keep);
}

/// Voxels within `reach` of a place where the body's outside is not the scan's own surface.
VoxelMask near_made_surface(const VoxelMask& solid, const std::vector<std::int16_t>& hu,
                            int tissue_hu, const Eigen::Vector3i& reach) {
  VoxelMask near(solid.size);
  const Eigen::Vector3i& size = solid.size;
  const std::array<std::size_t, 3> stride = {
      1, static_cast<std::size_t>(size.x()),
      static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y())};
  const auto made = [&](std::size_t v) { return (solid.on[v] != 0) != (hu[v] >= tissue_hu); };
  const auto mark = [&](int i, int j, int k) {
    for (int z = std::max(0, k - reach.z()); z <= std::min(size.z() - 1, k + reach.z()); ++z) {
      for (int y = std::max(0, j - reach.y()); y <= std::min(size.y() - 1, j + reach.y()); ++y) {
        const int begin = std::max(0, i - reach.x());
        const int end = std::min(size.x() - 1, i + reach.x());
        std::fill_n(near.on.begin() + static_cast<std::ptrdiff_t>(near.index(begin, y, z)),
                    end - begin + 1, std::uint8_t{1});
      }
    }
  };
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) {
        const std::size_t v = solid.index(i, j, k);
        const Eigen::Vector3i at(i, j, k);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (at[static_cast<int>(axis)] + 1 == size[static_cast<int>(axis)]) continue;
          const std::size_t next = v + stride[axis];
          if (solid.on[v] != solid.on[next] && (made(v) || made(next))) mark(i, j, k);
        }
      }
    }
  }
  return near;
}

/// Share of the body in the box round a voxel.
double body_share(const VoxelMask& solid, int i, int j, int k, const Eigen::Vector3i& reach) {
  int on = 0;
  int all = 0;
  for (int z = k - reach.z(); z <= k + reach.z(); ++z) {
    for (int y = j - reach.y(); y <= j + reach.y(); ++y) {
      for (int x = i - reach.x(); x <= i + reach.x(); ++x) {
        const Eigen::Vector3i at =
            Eigen::Vector3i(x, y, z).cwiseMax(0).cwiseMin(solid.size - Eigen::Vector3i::Ones());
        on += solid.on[solid.index(at.x(), at.y(), at.z())];
        ++all;
      }
    }
  }
  return static_cast<double>(on) / all;
}

}  // namespace

SkinField skin_field(const Volume& volume, const CoarseVolume& coarse, const VoxelMask& head,
                     const std::vector<StreakedSlices>& streaks, const SkinFieldOptions& options,
                     int threads) {
  const VoxelMask tissue = head_tissue(volume, coarse, head, options.tissue_hu, threads);
  VoxelMask solid = inverted(reachable_from_outside(tissue));
  limit_skin_streaks(volume, options.metal_hu, streaks, options.longest_spike_mm, solid);
  const VoxelMask sealed = sealed_from_outside(majority(solid, volume, coarse, threads),
                                               coarse.grid.spacing_mm, options.seal, threads);
  SkinField field;
  field.solid = closed_body(solid, sealed, volume, coarse, threads);

  field.hu.resize(volume.hu.size());
  const std::size_t slice_size = static_cast<std::size_t>(volume.grid.size.x()) *
                                 static_cast<std::size_t>(volume.grid.size.y());
  parallel_for(volume.grid.size.z(), threads, [&](int k) {
    const std::size_t first = static_cast<std::size_t>(k) * slice_size;
    for (std::size_t v = first; v < first + slice_size; ++v) {
      const bool is_tissue = volume.hu[v] >= options.tissue_hu;
      const bool is_solid = field.solid.on[v] != 0;
      field.hu[v] = is_solid == is_tissue ? volume.hu[v] : is_solid ? inside_hu : air_hu;
    }
  });

  Eigen::Vector3i reach;
  for (int a = 0; a < 3; ++a) {
    reach[a] = std::max(1, static_cast<int>(std::lround(smoothing_mm / volume.grid.spacing_mm[a])));
  }
  const VoxelMask near = near_made_surface(field.solid, volume.hu, options.tissue_hu, reach);
  parallel_for(volume.grid.size.z(), threads, [&](int k) {
    for (int j = 0; j < volume.grid.size.y(); ++j) {
      for (int i = 0; i < volume.grid.size.x(); ++i) {
        if (!near.at(i, j, k)) continue;
        const double share = body_share(field.solid, i, j, k, reach);
        field.hu[volume.grid.index(i, j, k)] =
            static_cast<std::int16_t>(std::lround(air_hu + share * (inside_hu - air_hu)));
      }
    }
  });
  return field;
}

}  // namespace skullstation
