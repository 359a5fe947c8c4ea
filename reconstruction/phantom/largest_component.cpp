#include "reconstruction/phantom/largest_component.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace skullstation {

TriangleMesh largest_component(const TriangleMesh& mesh) {
  const Eigen::Index count = mesh.vertices.rows();
  if (count == 0) return mesh;
  std::vector<int> parent(static_cast<std::size_t>(count));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int k = 1; k < 3; ++k) {
      const int a = root(mesh.triangles(f, 0));
      const int b = root(mesh.triangles(f, k));
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<int> sizes(static_cast<std::size_t>(count), 0);
  for (int v = 0; v < count; ++v) ++sizes[root(v)];
  const int kept = static_cast<int>(std::ranges::max_element(sizes) - sizes.begin());

  std::vector<int> new_index(static_cast<std::size_t>(count), -1);
  const bool has_normals = mesh.normals.rows() == count;
  const bool has_colors = mesh.colors.rows() == count;
  TriangleMesh part;
  part.vertices.resize(sizes[kept], 3);
  if (has_normals) part.normals.resize(sizes[kept], 3);
  if (has_colors) part.colors.resize(sizes[kept], 3);
  int next = 0;
  for (int v = 0; v < count; ++v) {
    if (root(v) != kept) continue;
    part.vertices.row(next) = mesh.vertices.row(v);
    if (has_normals) part.normals.row(next) = mesh.normals.row(v);
    if (has_colors) part.colors.row(next) = mesh.colors.row(v);
    new_index[v] = next++;
  }
  std::vector<Eigen::Index> triangles;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    if (new_index[mesh.triangles(f, 0)] >= 0) triangles.push_back(f);
  }
  part.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      part.triangles(static_cast<Eigen::Index>(i), k) = new_index[mesh.triangles(triangles[i], k)];
    }
  }
  return part;
}

}  // namespace skullstation
