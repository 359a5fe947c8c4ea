#include "reconstruction/mesh/mesh_topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

#include "core/disjoint_sets.h"

namespace skullstation {

namespace {

struct HalfEdge {
  std::uint64_t edge = 0;  // both vertices, the lower one first
  bool upwards = false;
  int triangle = 0;
  int side = 0;
};

std::vector<HalfEdge> sorted_half_edges(const Triangles& triangles) {
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(static_cast<std::size_t>(triangles.size()));
  for (int f = 0; f < triangles.rows(); ++f) {
    for (int side = 0; side < 3; ++side) {
      const auto from = static_cast<std::uint32_t>(triangles(f, side));
      const auto to = static_cast<std::uint32_t>(triangles(f, (side + 1) % 3));
      half_edges.push_back(
          {(std::uint64_t{std::min(from, to)} << 32) | std::max(from, to), from < to, f, side});
    }
  }
  std::ranges::sort(half_edges, {},
                    [](const HalfEdge& h) { return std::pair(h.edge, h.triangle); });
  return half_edges;
}

/// Vertices where several fans of triangles meet: joining a vertex's corners across shared edges
/// leaves more than one group.
std::size_t count_split_vertices(const TriangleMesh& mesh,
                                 const std::vector<HalfEdge>& half_edges) {
  DisjointSets corners(static_cast<std::size_t>(mesh.triangles.size()));
  const auto corner_at = [&](int triangle, std::uint32_t vertex) {
    for (int c = 0; c < 3; ++c) {
      if (mesh.triangles(triangle, c) == static_cast<int>(vertex)) return 3 * triangle + c;
    }
    return 3 * triangle;
  };
  for (std::size_t i = 0; i + 1 < half_edges.size(); ++i) {
    if (half_edges[i].edge != half_edges[i + 1].edge) continue;
    for (const std::uint32_t vertex : {static_cast<std::uint32_t>(half_edges[i].edge >> 32),
                                       static_cast<std::uint32_t>(half_edges[i].edge)}) {
      corners.join(corner_at(half_edges[i].triangle, vertex),
                   corner_at(half_edges[i + 1].triangle, vertex));
    }
  }
  std::vector<int> fan(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  std::vector<bool> split(fan.size(), false);
  for (int i = 0; i < mesh.triangles.size(); ++i) {
    const auto vertex = static_cast<std::size_t>(mesh.triangles.data()[i]);
    const int root = corners.root(i);
    if (fan[vertex] < 0) fan[vertex] = root;
    if (fan[vertex] != root) split[vertex] = true;
  }
  return static_cast<std::size_t>(std::ranges::count(split, true));
}

}  // namespace

MeshTopology topology_of(const TriangleMesh& mesh) {
  MeshTopology topology;
  const auto half_edges = sorted_half_edges(mesh.triangles);
  long edges = 0;
  for (std::size_t i = 0; i < half_edges.size();) {
    std::size_t end = i;
    int upwards = 0;
    while (end < half_edges.size() && half_edges[end].edge == half_edges[i].edge) {
      upwards += half_edges[end++].upwards ? 1 : 0;
    }
    ++edges;
    if (end - i == 1) ++topology.boundary_edges;
    if (end - i > 2 || (end - i == 2 && upwards != 1)) ++topology.nonmanifold_edges;
    i = end;
  }
  topology.nonmanifold_vertices = count_split_vertices(mesh, half_edges);
  const auto components = component_of_triangles(mesh);
  if (!components.empty()) topology.components = 1 + *std::ranges::max_element(components);
  std::vector<bool> used(static_cast<std::size_t>(mesh.vertices.rows()), false);
  for (int i = 0; i < mesh.triangles.size(); ++i) {
    used[static_cast<std::size_t>(mesh.triangles.data()[i])] = true;
  }
  topology.euler_characteristic =
      static_cast<long>(std::ranges::count(used, true)) - edges + mesh.triangles.rows();
  return topology;
}

std::vector<std::array<bool, 3>> boundary_edges(const Triangles& triangles) {
  std::vector<std::array<bool, 3>> is_boundary(static_cast<std::size_t>(triangles.rows()),
                                               {false, false, false});
  const std::vector<HalfEdge> half_edges = sorted_half_edges(triangles);
  for (std::size_t h = 0; h < half_edges.size(); ++h) {
    const std::uint64_t edge = half_edges[h].edge;
    const bool shared = (h > 0 && half_edges[h - 1].edge == edge) ||
                        (h + 1 < half_edges.size() && half_edges[h + 1].edge == edge);
    if (shared) continue;
    is_boundary[static_cast<std::size_t>(half_edges[h].triangle)]
               [static_cast<std::size_t>(half_edges[h].side)] = true;
  }
  return is_boundary;
}

std::vector<bool> boundary_vertices(const Triangles& triangles, Eigen::Index vertices) {
  std::vector<bool> is_boundary(static_cast<std::size_t>(vertices), false);
  const std::vector<std::array<bool, 3>> edges = boundary_edges(triangles);
  for (Eigen::Index f = 0; f < triangles.rows(); ++f) {
    for (int side = 0; side < 3; ++side) {
      if (!edges[static_cast<std::size_t>(f)][static_cast<std::size_t>(side)]) continue;
      is_boundary[static_cast<std::size_t>(triangles(f, side))] = true;
      is_boundary[static_cast<std::size_t>(triangles(f, (side + 1) % 3))] = true;
    }
  }
  return is_boundary;
}

std::vector<int> component_of_triangles(const TriangleMesh& mesh) {
  DisjointSets sets(static_cast<std::size_t>(mesh.vertices.rows()));
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    sets.join(mesh.triangles(f, 0), mesh.triangles(f, 1));
    sets.join(mesh.triangles(f, 0), mesh.triangles(f, 2));
  }
  std::vector<int> number(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  std::vector<int> component(static_cast<std::size_t>(mesh.triangles.rows()));
  int count = 0;
  for (std::size_t f = 0; f < component.size(); ++f) {
    int& root_number = number[static_cast<std::size_t>(
        sets.root(mesh.triangles(static_cast<Eigen::Index>(f), 0)))];
    if (root_number < 0) root_number = count++;
    component[f] = root_number;
  }
  return component;
}

TriangleMesh submesh(const TriangleMesh& mesh, const std::function<bool(Eigen::Index)>& keep) {
  std::vector<Eigen::Index> kept;
  std::vector<int> new_number(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    if (!keep(f)) continue;
    kept.push_back(f);
    for (const int v : mesh.triangles.row(f)) new_number[static_cast<std::size_t>(v)] = 0;
  }
  std::vector<Eigen::Index> vertices;
  for (std::size_t v = 0; v < new_number.size(); ++v) {
    if (new_number[v] < 0) continue;
    new_number[v] = static_cast<int>(vertices.size());
    vertices.push_back(static_cast<Eigen::Index>(v));
  }
  TriangleMesh part;
  part.vertices = mesh.vertices(vertices, Eigen::all);
  if (mesh.normals.rows() == mesh.vertices.rows()) {
    part.normals = mesh.normals(vertices, Eigen::all);
  }
  if (mesh.colors.rows() == mesh.vertices.rows()) part.colors = mesh.colors(vertices, Eigen::all);
  part.triangles = mesh.triangles(kept, Eigen::all);
  for (int i = 0; i < part.triangles.size(); ++i) {
    int& corner = part.triangles.data()[i];
    corner = new_number[static_cast<std::size_t>(corner)];
  }
  return part;
}

TriangleMesh largest_component(const TriangleMesh& mesh) {
  const std::vector<int> component = component_of_triangles(mesh);
  if (component.empty()) return mesh;
  std::vector<double> area(1 + static_cast<std::size_t>(*std::ranges::max_element(component)));
  for (std::size_t f = 0; f < component.size(); ++f) {
    const auto corners = mesh.triangles.row(static_cast<Eigen::Index>(f));
    const Eigen::Vector3d a = mesh.vertices.row(corners[0]);
    const Eigen::Vector3d b = mesh.vertices.row(corners[1]);
    const Eigen::Vector3d c = mesh.vertices.row(corners[2]);
    area[static_cast<std::size_t>(component[f])] += (b - a).cross(c - a).norm();
  }
  const auto largest = static_cast<int>(std::ranges::max_element(area) - area.begin());
  return submesh(mesh,
                 [&](Eigen::Index f) { return component[static_cast<std::size_t>(f)] == largest; });
}

double enclosed_volume(const TriangleMesh& mesh) {
  double six_volumes = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
    const Eigen::Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
    const Eigen::Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6.0;
}

}  // namespace skullstation
