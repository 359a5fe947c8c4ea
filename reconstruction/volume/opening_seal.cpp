#include "reconstruction/volume/opening_seal.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "reconstruction/volume/morphology.h"

namespace skullstation {

namespace {

constexpr float unreached = std::numeric_limits<float>::infinity();
constexpr int wall_voxels = 3;
/// What ends within this depth leads to no cavity, such as the furrow behind the ear.
constexpr double deepest_pocket_mm = 20.0;

/// Calls `work(index, step_mm)` for the 26 neighbours inside the grid.
template <class Work>
void for_neighbors(const VoxelMask& mask, std::size_t index, const Eigen::Vector3d& spacing_mm,
                   const Work& work) {
  const auto width = static_cast<std::size_t>(mask.size.x());
  const auto height = static_cast<std::size_t>(mask.size.y());
  const Eigen::Vector3i at(static_cast<int>(index % width),
                           static_cast<int>(index / width % height),
                           static_cast<int>(index / width / height));
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const Eigen::Vector3i next = at + step;
    if (n == 13 || (next.array() < 0).any() || (next.array() >= mask.size.array()).any()) continue;
    work(mask.index(next.x(), next.y(), next.z()),
         step.cast<double>().cwiseProduct(spacing_mm).norm());
  }
}

/// Way through the air [mm] from the `outer` air to every voxel of air, by the 26 neighbours
/// (Dijkstra 1959), as far as `depth_mm`.
std::vector<float> depth_below(const VoxelMask& outer, const VoxelMask& solid,
                               const Eigen::Vector3d& spacing_mm, double depth_mm) {
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  std::vector<float> depth(solid.on.size(), unreached);
  const auto spread = [&](std::size_t from) {
    for_neighbors(solid, from, spacing_mm, [&](std::size_t next, double step_mm) {
      const float way = depth[from] + static_cast<float>(step_mm);
      if (solid.on[next] != 0 || way > depth_mm || way >= depth[next]) return;
      depth[next] = way;
      open.push({way, next});
    });
  };
  for (std::size_t v = 0; v < depth.size(); ++v) {
    if (outer.on[v] != 0) depth[v] = 0.0F;
  }
  for (std::size_t v = 0; v < depth.size(); ++v) {
    if (outer.on[v] != 0) spread(v);
  }
  while (!open.empty()) {
    const auto [way, at] = open.top();
    open.pop();
    if (way == depth[at]) spread(at);
  }
  return depth;
}

/// Air deeper than `depth_mm` that leads on to where no way was found, through its like.
VoxelMask leading_inwards(const VoxelMask& solid, const std::vector<float>& depth,
                          const Eigen::Vector3d& spacing_mm, double depth_mm) {
  VoxelMask inwards(solid.size);
  std::vector<std::size_t> front;
  for (std::size_t v = 0; v < depth.size(); ++v) {
    if (solid.on[v] != 0 || depth[v] != unreached) continue;
    inwards.on[v] = 1;
    front.push_back(v);
  }
  while (!front.empty()) {
    const std::size_t from = front.back();
    front.pop_back();
    for_neighbors(solid, from, spacing_mm, [&](std::size_t next, double) {
      if (solid.on[next] != 0 || inwards.on[next] != 0 || depth[next] <= depth_mm) return;
      inwards.on[next] = 1;
      front.push_back(next);
    });
  }
  return inwards;
}

/// The closing of the body by a ball: what the ball can't reach from outside. Beyond the grid there
/// is air, but for the side of the feet, where the neck goes on.
VoxelMask closed_by_ball(const VoxelMask& solid, const Eigen::Vector3d& spacing_mm,
                         double radius_mm, int threads) {
  const Eigen::Vector3i margin =
      (spacing_mm.cwiseInverse() * radius_mm).array().ceil().cast<int>() + 1;
  const Eigen::Vector3i before(margin.x(), margin.y(), 0);
  VoxelMask padded(solid.size + before + margin);
  const auto copy = [&](const VoxelMask& from, const Eigen::Vector3i& from_at, VoxelMask& to,
                        const Eigen::Vector3i& to_at) {
    for (int k = 0; k < solid.size.z(); ++k) {
      for (int j = 0; j < solid.size.y(); ++j) {
        const auto* row = from.on.data() + from.index(from_at.x(), from_at.y() + j, k);
        std::copy_n(row, solid.size.x(), to.on.data() + to.index(to_at.x(), to_at.y() + j, k));
      }
    }
  };
  copy(solid, Eigen::Vector3i::Zero(), padded, before);
  padded = dilated(padded, radius_mm, spacing_mm, threads);
  padded = eroded(padded, radius_mm, spacing_mm, threads);
  VoxelMask closed(solid.size);
  copy(padded, before, closed, Eigen::Vector3i::Zero());
  return closed;
}

}  // namespace

VoxelMask filled_behind_openings(const VoxelMask& solid, const Eigen::Vector3d& spacing_mm,
                                 double opening_mm, int threads) {
  return inverted(
      reachable_from_outside(closed_by_ball(solid, spacing_mm, 0.5 * opening_mm, threads)));
}

VoxelMask sealed_from_outside(const VoxelMask& solid, const Eigen::Vector3d& spacing_mm,
                              const OpeningSealOptions& options, int threads) {
  const VoxelMask outer =
      reachable_from_outside(closed_by_ball(solid, spacing_mm, options.closing_radius_mm, threads));
  const auto depth =
      depth_below(outer, solid, spacing_mm, std::max(options.depth_mm, deepest_pocket_mm));
  const VoxelMask inwards = leading_inwards(solid, depth, spacing_mm, options.depth_mm);

  VoxelMask sealed(solid.size);
  enum : std::uint8_t { unknown, entered, blocked };
  std::vector<std::uint8_t> answer(solid.on.size(), unknown);
  std::vector<std::size_t> front;
  for (std::size_t v = 0; v < answer.size(); ++v) {
    if (solid.on[v] != 0) continue;
    answer[v] = inwards.on[v] != 0 ? blocked : entered;
    front.push_back(v);
  }
  for (int round = 0; round < wall_voxels; ++round) {
    std::vector<std::size_t> next_front;
    for (const std::size_t v : front) {
      for_neighbors(solid, v, spacing_mm, [&](std::size_t next, double) {
        if (answer[next] != unknown) return;
        answer[next] = answer[v];
        next_front.push_back(next);
      });
    }
    front = std::move(next_front);
  }
  for (std::size_t v = 0; v < answer.size(); ++v) sealed.on[v] = answer[v] == entered ? 0 : 1;
  return sealed;
}

}  // namespace skullstation
