#include "capture/simulation/shading_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>

#include "capture/simulation/srgb.h"
#include "core/units.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Faces that meet at more than this are seen as a crease.
constexpr double crease_deg = 50.0;

Result<void> check(const TriangleMesh& mesh) {
  if (!mesh.vertices.allFinite()) {
    return fail(ErrorKind::bad_input, "simulated specimen", "has coordinates that are not finite");
  }
  if (mesh.triangles.size() > 0 &&
      (mesh.triangles.minCoeff() < 0 || mesh.triangles.maxCoeff() >= mesh.vertices.rows())) {
    return fail(ErrorKind::bad_input, "simulated specimen",
                "has triangles with vertices that don't exist");
  }
  if (mesh.colors.rows() != 0 && mesh.colors.rows() != mesh.vertices.rows()) {
    return fail(ErrorKind::bad_input, "simulated specimen",
                "has " + std::to_string(mesh.colors.rows()) + " colours for " +
                    std::to_string(mesh.vertices.rows()) + " vertices");
  }
  return {};
}

using Edge = std::uint64_t;
Edge edge_of(int a, int b) {
  if (a > b) std::swap(a, b);
  return (static_cast<Edge>(a) << 32) | static_cast<std::uint32_t>(b);
}

struct Divided {
  std::vector<Vector3d> vertices;
  std::vector<Vector3f> colors;
  std::vector<std::array<int, 3>> triangles;
};

/// Halves every long edge once. An edge is halved for both its triangles, so no gaps open.
/// Returns false, and changes nothing, if that would make too many triangles or no edge is long.
bool divide_once(Divided& mesh, double longest_edge_mm, std::size_t most_triangles) {
  const auto is_long = [&](int a, int b) {
    return (mesh.vertices[a] - mesh.vertices[b]).squaredNorm() > longest_edge_mm * longest_edge_mm;
  };
  std::size_t triangle_count = mesh.triangles.size();
  for (const auto& [a, b, c] : mesh.triangles) {
    triangle_count += is_long(a, b) + is_long(b, c) + is_long(c, a);
  }
  if (triangle_count == mesh.triangles.size() || triangle_count > most_triangles) return false;

  std::unordered_map<Edge, int> middles;
  const auto middle = [&](int a, int b) {
    if (!is_long(a, b)) return -1;
    const auto [found, added] =
        middles.try_emplace(edge_of(a, b), static_cast<int>(mesh.vertices.size()));
    if (added) {
      const Vector3d between = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
      mesh.vertices.push_back(between);
      if (!mesh.colors.empty()) {
        const Vector3f color = 0.5F * (mesh.colors[a] + mesh.colors[b]);
        mesh.colors.push_back(color);
      }
    }
    return found->second;
  };
  std::vector<std::array<int, 3>> triangles;
  triangles.reserve(triangle_count);
  for (const std::array<int, 3>& corners : mesh.triangles) {
    const std::array<int, 3> middles_of = {middle(corners[0], corners[1]),
                                           middle(corners[1], corners[2]),
                                           middle(corners[2], corners[0])};
    // Walk round the triangle's rim, which has 3 to 6 points, and cut ears at the halved edges.
    std::vector<int> rim;
    for (int i = 0; i < 3; ++i) {
      const int before = middles_of[(i + 2) % 3];
      const int after = middles_of[i];
      if (before >= 0 && after >= 0) {
        triangles.push_back({before, corners[i], after});
      } else {
        rim.push_back(corners[i]);
      }
      if (after >= 0) rim.push_back(after);
    }
    // The fan around a middle; around a corner beside the only middle, one triangle would be flat
    // and the other the undivided one.
    const auto is_middle = [&](int v) {
      return std::find(middles_of.begin(), middles_of.end(), v) != middles_of.end();
    };
    std::rotate(rim.begin(), std::find_if(rim.begin(), rim.end(), is_middle), rim.end());
    for (std::size_t i = 2; i < rim.size(); ++i) {
      triangles.push_back({rim[0], rim[i - 1], rim[i]});
    }
  }
  mesh.triangles = std::move(triangles);
  return true;
}

/// Normals of the triangles with the length of twice their area.
std::vector<Vector3d> doubled_area_normals(const Divided& mesh) {
  std::vector<Vector3d> normals;
  normals.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    normals.emplace_back(
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]));
  }
  return normals;
}

Vector3f unit_or_up(const Vector3d& v) {
  const double length = v.norm();
  return length > 0.0 ? Vector3f((v / length).cast<float>()) : Vector3f(Vector3f::UnitZ());
}

void add_normals(const Divided& mesh, ShadingMesh& shading) {
  const std::vector<Vector3d> normals = doubled_area_normals(mesh);
  // Triangles around each vertex, as one array with an offset per vertex.
  std::vector<int> first(mesh.vertices.size() + 1, 0);
  for (const auto& triangle : mesh.triangles) {
    for (const int v : triangle) ++first[v + 1];
  }
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  std::vector<int> around(3 * mesh.triangles.size());
  std::vector<int> next(first.begin(), first.end() - 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int v : mesh.triangles[t]) around[next[v]++] = static_cast<int>(t);
  }

  shading.vertex_normals.reserve(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    Vector3d sum = Vector3d::Zero();
    for (int i = first[v]; i < first[v + 1]; ++i) sum += normals[around[i]];
    shading.vertex_normals.push_back(unit_or_up(sum));
  }
  // Weighted by area, over the triangles that are not across a crease.
  const double smooth_cosine = std::cos(radians(crease_deg));
  std::vector<double> lengths;
  lengths.reserve(normals.size());
  for (const Vector3d& normal : normals) lengths.push_back(normal.norm());
  shading.corner_normals.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int v : mesh.triangles[t]) {
      Vector3d sum = normals[t];
      for (int i = first[v]; i < first[v + 1]; ++i) {
        const Vector3d& other = normals[around[i]];
        if (around[i] != static_cast<int>(t) &&
            other.dot(normals[t]) > smooth_cosine * lengths[t] * lengths[around[i]]) {
          sum += other;
        }
      }
      shading.corner_normals.push_back(unit_or_up(sum));
    }
  }
}

}  // namespace

Result<ShadingMesh> make_shading_mesh(const TriangleMesh& mesh, double longest_edge_mm,
                                      int most_triangles) {
  if (const auto sound = check(mesh); !sound) return forward(sound);
  Divided divided;
  divided.vertices.reserve(static_cast<std::size_t>(mesh.vertices.rows()));
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    divided.vertices.emplace_back(mesh.vertices.row(v));
  }
  for (Eigen::Index v = 0; v < mesh.colors.rows(); ++v) {
    divided.colors.emplace_back(linear_from_srgb(mesh.colors(v, 0)),
                                linear_from_srgb(mesh.colors(v, 1)),
                                linear_from_srgb(mesh.colors(v, 2)));
  }
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    divided.triangles.push_back({mesh.triangles(t, 0), mesh.triangles(t, 1), mesh.triangles(t, 2)});
  }
  while (divide_once(divided, longest_edge_mm, static_cast<std::size_t>(most_triangles))) {
  }

  ShadingMesh shading;
  add_normals(divided, shading);
  shading.colors = std::move(divided.colors);
  shading.vertices.resize(static_cast<Eigen::Index>(divided.vertices.size()), 3);
  for (std::size_t v = 0; v < divided.vertices.size(); ++v) {
    shading.vertices.row(static_cast<Eigen::Index>(v)) = divided.vertices[v].transpose();
  }
  shading.triangles.resize(static_cast<Eigen::Index>(divided.triangles.size()), 3);
  for (std::size_t t = 0; t < divided.triangles.size(); ++t) {
    const auto& [a, b, c] = divided.triangles[t];
    shading.triangles.row(static_cast<Eigen::Index>(t)) << a, b, c;
  }
  return shading;
}

}  // namespace skullstation
