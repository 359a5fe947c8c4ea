#include "reconstruction/volume/voxel_components.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iterator>

#include "core/disjoint_sets.h"

namespace skullstation {

namespace {

/// How far beyond its ends a run reaches for neighbours in the row that lies `dj`, `dk` away; -1
/// if that row has none.
int reach(int dj, int dk, Connectivity connectivity) {
  const int rows_away = std::abs(dj) + std::abs(dk);
  switch (connectivity) {
    case Connectivity::face6: return rows_away == 1 ? 0 : -1;
    case Connectivity::edge18: return rows_away == 1 ? 1 : 0;
    case Connectivity::corner26: return 1;
  }
  return -1;
}

}  // namespace

VoxelComponents::VoxelComponents(const VoxelMask& mask, Connectivity connectivity)
    : size_(mask.size) {
  DisjointSets sets;
  const int width = size_.x();
  row_start_.reserve(static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(size_.z()) + 1);
  for (int k = 0; k < size_.z(); ++k) {
    for (int j = 0; j < size_.y(); ++j) {
      row_start_.push_back(runs_.size());
      const std::uint8_t* row_on = mask.on.data() + mask.index(0, j, k);
      const auto find = [&](int from, int value) {
        const void* found =
            std::memchr(row_on + from, value, static_cast<std::size_t>(width - from));
        return found ? static_cast<int>(static_cast<const std::uint8_t*>(found) - row_on) : width;
      };
      for (int begin = find(0, 1); begin < width;) {
        const int end = find(begin, 0);
        sets.add();
        runs_.push_back({begin, end, 0});
        begin = end < width ? find(end, 1) : width;
      }
      // Join with the rows that were done before; runs of both rows are in order.
      const std::size_t own_begin = row_start_.back();
      const std::size_t own_end = runs_.size();
      for (const auto& [dj, dk] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) {
        const int extra = reach(dj, dk, connectivity);
        const int other_j = j + dj;
        const int other_k = k + dk;
        if (extra < 0 || other_j < 0 || other_j >= size_.y() || other_k < 0) continue;
        const std::size_t other_row =
            static_cast<std::size_t>(other_k) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(other_j);
        std::size_t other = row_start_[other_row];
        const std::size_t other_end = row_start_[other_row + 1];
        for (std::size_t own = own_begin; own < own_end; ++own) {
          while (other < other_end && runs_[other].end + extra <= runs_[own].begin) ++other;
          for (std::size_t o = other; o < other_end && runs_[o].begin < runs_[own].end + extra;
               ++o) {
            sets.join(static_cast<int>(own), static_cast<int>(o));
          }
        }
      }
    }
  }
  row_start_.push_back(runs_.size());

  std::vector<int> number(runs_.size(), -1);
  int j = 0;
  int k = 0;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    while (row_start_[static_cast<std::size_t>(k) * static_cast<std::size_t>(size_.y()) +
                      static_cast<std::size_t>(j) + 1] <= r) {
      if (++j == size_.y()) {
        j = 0;
        ++k;
      }
    }
    VoxelRun& run = runs_[r];
    int& root_number = number[static_cast<std::size_t>(sets.root(static_cast<int>(r)))];
    const Eigen::Vector3i first(run.begin, j, k);
    const Eigen::Vector3i last(run.end - 1, j, k);
    if (root_number < 0) {
      root_number = static_cast<int>(components_.size());
      components_.push_back({0, first, last});
    }
    run.component = root_number;
    Component& component = components_[static_cast<std::size_t>(root_number)];
    component.voxels += static_cast<std::size_t>(run.end - run.begin);
    component.least = component.least.cwiseMin(first);
    component.most = component.most.cwiseMax(last);
  }
}

int VoxelComponents::largest() const {
  if (components_.empty()) return -1;
  const auto most = std::ranges::max_element(components_, {}, &Component::voxels);
  return static_cast<int>(most - components_.begin());
}

std::span<const VoxelRun> VoxelComponents::row(int j, int k) const {
  const std::size_t r = static_cast<std::size_t>(k) * static_cast<std::size_t>(size_.y()) +
                        static_cast<std::size_t>(j);
  return {runs_.data() + row_start_[r], row_start_[r + 1] - row_start_[r]};
}

int VoxelComponents::at(int i, int j, int k) const {
  const auto runs = row(j, k);
  const auto after = std::ranges::upper_bound(runs, i, {}, &VoxelRun::begin);
  if (after == runs.begin()) return -1;
  const VoxelRun& run = *std::prev(after);
  return i < run.end ? run.component : -1;
}

VoxelMask VoxelComponents::mask_of(const std::vector<bool>& keep) const {
  VoxelMask mask(size_);
  for_each_run([&](const VoxelRun& run, int j, int k) {
    if (!keep[static_cast<std::size_t>(run.component)]) return;
    std::fill_n(mask.on.begin() + static_cast<std::ptrdiff_t>(mask.index(run.begin, j, k)),
                run.end - run.begin, std::uint8_t{1});
  });
  return mask;
}

}  // namespace skullstation
