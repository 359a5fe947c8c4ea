#include "reconstruction/volume/spine_split.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace skullstation {

namespace {

// Distances from the canal's middle and heights below the foramen magnum [mm]; adult anatomy with
// room for tilted heads.
constexpr double spine_radius_mm = 30.0;
constexpr double spine_begins_below_mm = 18.0;
/// Nearer to the foramen only what lies in the midline is a vertebra's for sure: the arches of the
/// atlas and the dens; the occipital condyles lie to the sides.
constexpr double midline_half_width_mm = 8.0;
constexpr double midline_begins_below_mm = 8.0;
constexpr double skull_above_mm = 6.0;
constexpr double skull_in_front_mm = 48.0;
constexpr double skull_aside_mm = 42.0;
constexpr double skull_aside_down_to_mm = 30.0;
/// With less bone than this well below the foramen, the scan ends above the spine.
constexpr double least_spine_mm3 = 1000.0;

enum Label : std::uint8_t { outside_mask = 0, open = 1, queued = 2, skull = 3, spine = 4 };

/// `up` is the canal's: heads are nodded and tilted.
Label seed_at(const Eigen::Vector3d& place, const SpinalCanal& canal, const Eigen::Vector3d& up) {
  const double below_mm = (canal.foramen_magnum_mm - place).dot(up);
  const Eigen::Vector3d from_middle = place - canal.middle_at(place.z());
  const double aside_mm = std::abs(from_middle.x());
  if (below_mm < -skull_above_mm || from_middle.y() < -skull_in_front_mm) return skull;
  if (aside_mm > skull_aside_mm && below_mm < skull_aside_down_to_mm) return skull;
  const double radius_mm = from_middle.head<2>().norm();
  if (radius_mm < spine_radius_mm &&
      (below_mm > spine_begins_below_mm ||
       (below_mm > midline_begins_below_mm && aside_mm < midline_half_width_mm))) {
    return spine;
  }
  return open;
}

/// The part of the grid where the two may meet.
struct Box {
  Eigen::Vector3i least = Eigen::Vector3i::Zero();
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(i);
  }
};

Box box_round(const SpinalCanal& canal, const VoxelGrid& grid) {
  Eigen::Vector3d least = canal.foramen_magnum_mm;
  Eigen::Vector3d most = canal.foramen_magnum_mm;
  for (const Eigen::Vector3d& middle : canal.middle_mm) {
    least = least.cwiseMin(middle);
    most = most.cwiseMax(middle);
  }
  least -= Eigen::Vector3d(60.0, 60.0, 1e6);
  most += Eigen::Vector3d(60.0, 80.0, skull_above_mm + 4.0);
  Box box;
  for (int a = 0; a < 3; ++a) {
    const double last = grid.size[a] - 1;
    const double from = std::clamp(std::floor(least[a] / grid.spacing_mm[a]), 0.0, last);
    const double to = std::clamp(std::ceil(most[a] / grid.spacing_mm[a]), 0.0, last);
    box.least[a] = static_cast<int>(from);
    box.size[a] = static_cast<int>(to - from) + 1;
  }
  return box;
}

class Watershed {
 public:
  Watershed(const Volume& volume, const Box& box) : volume_(volume), box_(box) {
    labels_.resize(static_cast<std::size_t>(box.size.x()) * static_cast<std::size_t>(box.size.y()) *
                       static_cast<std::size_t>(box.size.z()),
                   outside_mask);
  }

  Label& label(int i, int j, int k) { return labels_[box_.index(i, j, k)]; }

  /// Spreads the seeds: always from the densest voxel that borders on a labelled one, in the order
  /// in which they came among equals.
  void flood() {
    for (int k = 0; k < box_.size.z(); ++k) {
      for (int j = 0; j < box_.size.y(); ++j) {
        for (int i = 0; i < box_.size.x(); ++i) {
          const Label own = label(i, j, k);
          if (own == skull || own == spine) queue_neighbors(i, j, k, own);
        }
      }
    }
    while (highest_ >= 0) {
      auto& level = levels_[static_cast<std::size_t>(highest_)];
      if (level.begin == level.entries.size()) {
        level = {};
        --highest_;
        continue;
      }
      const Entry entry = level.entries[level.begin++];
      label(entry.i, entry.j, entry.k) = entry.label;
      queue_neighbors(entry.i, entry.j, entry.k, entry.label);
    }
  }

 private:
  struct Entry {
    int i = 0;
    int j = 0;
    int k = 0;
    Label label = open;
  };
  struct Level {
    std::vector<Entry> entries;
    std::size_t begin = 0;
  };
  static constexpr int hu_per_level = 8;

  int level_of(int i, int j, int k) const {
    const int hu = volume_.at(box_.least.x() + i, box_.least.y() + j, box_.least.z() + k);
    return std::clamp(hu / hu_per_level, 0, static_cast<int>(levels_.size()) - 1);
  }

  void queue_neighbors(int i, int j, int k, Label own) {
    for (int dk = -1; dk <= 1; ++dk) {
      for (int dj = -1; dj <= 1; ++dj) {
        for (int di = -1; di <= 1; ++di) {
          const Eigen::Vector3i next(i + di, j + dj, k + dk);
          if ((next.array() < 0).any() || (next.array() >= box_.size.array()).any()) continue;
          Label& other = label(next.x(), next.y(), next.z());
          if (other != open) continue;
          other = queued;
          const int level = level_of(next.x(), next.y(), next.z());
          levels_[static_cast<std::size_t>(level)].entries.push_back(
              {next.x(), next.y(), next.z(), own});
          highest_ = std::max(highest_, level);
        }
      }
    }
  }

  const Volume& volume_;
  Box box_;
  std::vector<Label> labels_;
  std::array<Level, 512> levels_;
  int highest_ = -1;
};

}  // namespace

std::size_t remove_spine(const Volume& volume, const SpinalCanal& canal, VoxelMask& bone) {
  const VoxelGrid& grid = volume.grid;
  const Box box = box_round(canal, grid);
  Watershed watershed(volume, box);
  const Eigen::Vector3d up = canal.up();
  double sure_spine_mm3 = 0.0;
  for (int k = 0; k < box.size.z(); ++k) {
    for (int j = 0; j < box.size.y(); ++j) {
      for (int i = 0; i < box.size.x(); ++i) {
        const Eigen::Vector3i voxel = box.least + Eigen::Vector3i(i, j, k);
        if (!bone.at(voxel.x(), voxel.y(), voxel.z())) continue;
        const Eigen::Vector3d place = voxel.cast<double>().cwiseProduct(grid.spacing_mm);
        const Label seed = seed_at(place, canal, up);
        watershed.label(i, j, k) = seed;
        const bool well_below = (canal.foramen_magnum_mm - place).dot(up) > spine_begins_below_mm;
        if (seed == spine && well_below) sure_spine_mm3 += grid.spacing_mm.prod();
      }
    }
  }
  if (sure_spine_mm3 < least_spine_mm3) return 0;
  watershed.flood();
  std::size_t removed = 0;
  for (int k = 0; k < box.size.z(); ++k) {
    for (int j = 0; j < box.size.y(); ++j) {
      for (int i = 0; i < box.size.x(); ++i) {
        if (watershed.label(i, j, k) != spine) continue;
        const Eigen::Vector3i voxel = box.least + Eigen::Vector3i(i, j, k);
        bone.on[bone.index(voxel.x(), voxel.y(), voxel.z())] = 0;
        ++removed;
      }
    }
  }
  return removed;
}

}  // namespace skullstation
