#include "tests/unit/phantom/mesh_topology.h"

#include <map>
#include <numeric>
#include <utility>
#include <vector>

namespace skullstation {

namespace {

int root_of(std::vector<int>& parent, int v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

}  // namespace

MeshTopology topology_of(const TriangleMesh& mesh) {
  MeshTopology topology;
  const int vertex_count = static_cast<int>(mesh.vertices.rows());
  std::map<std::pair<int, int>, int> sides;
  std::vector<int> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), 0);
  // For each vertex, the ring of its neighbours: each triangle links one to the next.
  std::vector<std::map<int, int>> ring(vertex_count);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles(f, k);
      const int b = mesh.triangles(f, (k + 1) % 3);
      const int c = mesh.triangles(f, (k + 2) % 3);
      ++sides[{a, b}];
      ring[a][b] = c;
      parent[root_of(parent, a)] = root_of(parent, b);
    }
  }
  for (const auto& [side, count] : sides) {
    if (count != 1 || !sides.contains({side.second, side.first})) ++topology.open_or_crowded_edges;
  }
  for (int v = 0; v < vertex_count; ++v) {
    if (ring[v].empty()) {
      ++topology.pinched_vertices;
      continue;
    }
    std::size_t length = 0;
    const int start = ring[v].begin()->first;
    int at = start;
    do {
      const auto next = ring[v].find(at);
      if (next == ring[v].end()) break;
      at = next->second;
      ++length;
    } while (at != start && length <= ring[v].size());
    if (at != start || length != ring[v].size()) ++topology.pinched_vertices;
    if (root_of(parent, v) == v) ++topology.components;
  }
  topology.euler_characteristic =
      vertex_count - static_cast<long>(sides.size()) / 2 + static_cast<long>(mesh.triangles.rows());
  return topology;
}

double enclosed_volume_mm3(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
    const Eigen::Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
    const Eigen::Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
    volume += a.dot(b.cross(c)) / 6.0;
  }
  return volume;
}

}  // namespace skullstation
