#include "reconstruction/registration/observed_bone.h"

#include <algorithm>

#include "reconstruction/registration/point_tree.h"

namespace skullstation {

std::vector<int> observed_outer(const SkullTemplate& skull, const std::vector<bool>& observed) {
  std::vector<int> vertices;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (skull.outer[at] && observed[at]) vertices.push_back(v);
  }
  return vertices;
}

double observed_share(const SkullTemplate& skull, const std::vector<bool>& observed,
                      std::optional<SkullBone> bone) {
  const Eigen::VectorXd area = vertex_areas(surface_of(skull, skull.vertices));
  double all = 0.0;
  double seen = 0.0;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (!skull.outer[at] || (bone && bone_of(skull.region[at]) != *bone)) continue;
    all += area[v];
    if (observed[at]) seen += area[v];
  }
  return all > 0.0 ? seen / all : 1.0;
}

Eigen::VectorXd observed_around(const SkullTemplate& skull, const std::vector<bool>& observed) {
  constexpr int neighbours = 24;
  const std::vector<bool> everything(static_cast<std::size_t>(skull.boundary_count), true);
  const std::vector<int> outer = observed_outer(skull, everything);
  Eigen::VectorXd share = Eigen::VectorXd::Zero(skull.boundary_count);
  if (outer.empty()) return share;
  const PointTree tree(skull.vertices(outer, Eigen::all));
  for (const int v : outer) {
    const auto around = tree.nearest(skull.vertices.row(v).transpose(), neighbours);
    const auto seen = std::ranges::count_if(around, [&](const NearPoint& near) {
      return observed[static_cast<std::size_t>(outer[static_cast<std::size_t>(near.index)])];
    });
    share[v] = static_cast<double>(seen) / static_cast<double>(around.size());
  }
  return share;
}

}  // namespace skullstation
