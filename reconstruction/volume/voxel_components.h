#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace skullstation {

/// One flag for each voxel, i fastest, as in a VoxelGrid.
struct VoxelMask {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<std::uint8_t> on;  ///< 0 or 1

  VoxelMask() = default;
  explicit VoxelMask(const Eigen::Vector3i& voxels, bool value = false)
      : size(voxels),
        on(static_cast<std::size_t>(voxels.x()) * static_cast<std::size_t>(voxels.y()) *
               static_cast<std::size_t>(voxels.z()),
           value ? 1 : 0) {}

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(i);
  }
  bool at(int i, int j, int k) const { return on[index(i, j, k)] != 0; }
};

/// Voxels that touch by a face, by a face or an edge, or by a corner at least.
enum class Connectivity { face6, edge18, corner26 };

/// A stretch of voxels [begin, end) along i that are on.
struct VoxelRun {
  int begin = 0;
  int end = 0;
  int component = 0;
};

/// The connected components of a mask, kept as runs along i: a head's take a hundredth of the
/// voxels' memory. Components are numbered in the order of their first voxels.
class VoxelComponents {
 public:
  struct Component {
    std::size_t voxels = 0;
    Eigen::Vector3i least = Eigen::Vector3i::Zero();
    Eigen::Vector3i most = Eigen::Vector3i::Zero();
  };

  VoxelComponents(const VoxelMask& mask, Connectivity connectivity);

  const std::vector<Component>& all() const { return components_; }
  /// Number of the one with the most voxels; -1 if there is none.
  int largest() const;
  std::span<const VoxelRun> row(int j, int k) const;
  /// The component that the voxel belongs to, -1 if it is off.
  int at(int i, int j, int k) const;

  /// Calls `work(run, j, k)` for every run.
  template <class Work>
  void for_each_run(const Work& work) const {
    for (int k = 0; k < size_.z(); ++k) {
      for (int j = 0; j < size_.y(); ++j) {
        for (const VoxelRun& run : row(j, k)) work(run, j, k);
      }
    }
  }

  /// The voxels of the components that `keep` holds true for.
  VoxelMask mask_of(const std::vector<bool>& keep) const;

 private:
  Eigen::Vector3i size_;
  std::vector<VoxelRun> runs_;
  std::vector<std::size_t> row_start_;
  std::vector<Component> components_;
};

}  // namespace skullstation
