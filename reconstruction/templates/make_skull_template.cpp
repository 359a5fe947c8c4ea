#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/phantom/skull_landmarks.h"
#include "reconstruction/registration/surface_places.h"
#include "reconstruction/rendering/outside.h"
#include "reconstruction/templates/distance_grid.h"
#include "reconstruction/templates/make_templates.h"
#include "reconstruction/templates/skull_regions.h"
#include "reconstruction/templates/tetrahedralization.h"

namespace skullstation {

namespace {

/// The faces of a tetrahedron, seen from outside counter-clockwise.
constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

/// Finer in the face than on the vault, with a smooth passage between.
double edge_mm_at(const Eigen::Vector3d& point, double face_edge_mm) {
  const double behind = std::clamp((point.y() + 45.0) / 40.0, 0.0, 1.0);
  const double above = std::clamp((point.z() - 50.0) / 25.0, 0.0, 1.0);
  return face_edge_mm * (1.0 + 0.6 * std::max(behind, above));
}

/// Only the largest set of tetrahedra that hang together by faces.
void keep_largest_piece(TetrahedralMesh& mesh) {
  DisjointSets pieces(static_cast<std::size_t>(mesh.tetrahedra.rows()));
  std::map<std::array<int, 3>, int> open;
  for (int t = 0; t < mesh.tetrahedra.rows(); ++t) {
    for (const auto& face : kFaces) {
      std::array<int, 3> key{mesh.tetrahedra(t, face[0]), mesh.tetrahedra(t, face[1]),
                             mesh.tetrahedra(t, face[2])};
      std::ranges::sort(key);
      const auto [place, added] = open.try_emplace(key, t);
      if (!added) pieces.join(t, place->second);
    }
  }
  std::map<int, int> sizes;
  for (int t = 0; t < mesh.tetrahedra.rows(); ++t) ++sizes[pieces.root(t)];
  const int largest =
      std::ranges::max_element(sizes, {}, [](const auto& entry) { return entry.second; })->first;
  std::vector<int> number(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  TetrahedralMesh kept;
  kept.vertices.resize(mesh.vertices.rows(), 3);
  kept.tetrahedra.resize(sizes[largest], 4);
  int vertices = 0;
  int tetrahedra = 0;
  for (int t = 0; t < mesh.tetrahedra.rows(); ++t) {
    if (pieces.root(t) != largest) continue;
    for (int i = 0; i < 4; ++i) {
      int& v = number[static_cast<std::size_t>(mesh.tetrahedra(t, i))];
      if (v < 0) {
        v = vertices++;
        kept.vertices.row(v) = mesh.vertices.row(mesh.tetrahedra(t, i));
      }
      kept.tetrahedra(tetrahedra, i) = v;
    }
    ++tetrahedra;
  }
  kept.vertices.conservativeResize(vertices, 3);
  mesh = std::move(kept);
}

/// Both bones in one mesh, the surface's vertices first, its triangles taken from the tetrahedra.
SkullTemplate assembled(const std::array<TetrahedralMesh, 2>& bones) {
  const auto first = static_cast<int>(bones[0].vertices.rows());
  const auto count = first + static_cast<int>(bones[1].vertices.rows());
  SkullTemplate skull;
  Points3 vertices(count, 3);
  vertices << bones[0].vertices, bones[1].vertices;
  Tetrahedra tetrahedra(bones[0].tetrahedra.rows() + bones[1].tetrahedra.rows(), 4);
  tetrahedra << bones[0].tetrahedra, (bones[1].tetrahedra.array() + first).matrix();

  std::map<std::array<int, 3>, std::array<int, 3>> single;
  for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
    for (const auto& face : kFaces) {
      const std::array<int, 3> corners{tetrahedra(t, face[0]), tetrahedra(t, face[1]),
                                       tetrahedra(t, face[2])};
      std::array<int, 3> key = corners;
      std::ranges::sort(key);
      if (single.erase(key) == 0) single.emplace(key, corners);
    }
  }
  std::vector<char> on_surface(static_cast<std::size_t>(count), 0);
  for (const auto& [key, corners] : single) {
    for (const int v : corners) on_surface[static_cast<std::size_t>(v)] = 1;
  }
  std::vector<int> number(static_cast<std::size_t>(count));
  int next = 0;
  for (const char wanted : {1, 0}) {
    for (int v = 0; v < count; ++v) {
      if (on_surface[static_cast<std::size_t>(v)] == wanted) {
        number[static_cast<std::size_t>(v)] = next++;
      }
    }
    if (wanted == 1) skull.boundary_count = next;
  }
  const auto renumbered = [&](int v) { return number[static_cast<std::size_t>(v)]; };
  skull.vertices.resize(count, 3);
  skull.region.resize(static_cast<std::size_t>(count));
  for (int v = 0; v < count; ++v) {
    skull.vertices.row(renumbered(v)) = vertices.row(v);
    skull.region[static_cast<std::size_t>(renumbered(v))] =
        skull_region_at(vertices.row(v), v < first ? SkullBone::cranium : SkullBone::mandible);
  }
  skull.tetrahedra = tetrahedra.unaryExpr(renumbered);
  skull.boundary.resize(static_cast<Eigen::Index>(single.size()), 3);
  Eigen::Index f = 0;
  for (const auto& [key, corners] : single) {
    skull.boundary.row(f++) << renumbered(corners[0]), renumbered(corners[1]),
        renumbered(corners[2]);
  }
  return skull;
}

}  // namespace

Result<void> SkullTemplateOptions::validate() const {
  if (!(face_edge_mm >= 1.0 && face_edge_mm <= 12.0)) {
    return fail(ErrorKind::usage, "skull edge", fmt::format("{} mm", face_edge_mm),
                "give a length from 1 to 12 mm");
  }
  return {};
}

Result<SkullTemplate> make_skull_template(const SkullTemplateOptions& options,
                                          const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  const SkullSolids solids = skull_solids();
  // Thin walls of the orbit and the nose want some points across.
  const double cell_mm = std::clamp(0.35 * options.face_edge_mm, 0.5, 1.5);
  std::array<TetrahedralMesh, 2> bones;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "template", "cancelled");
    progress.report(0.45 * static_cast<double>(b), "filling the bones with tetrahedra");
    const ImplicitSolid& solid = b == 0 ? *solids.cranium : *solids.mandible;
    const DistanceGrid grid(solid, cell_mm, options.threads);
    TetrahedralizationOptions filling;
    filling.distance_mm = [&](const Eigen::Vector3d& p) { return grid.distance_mm(p); };
    filling.edge_mm = [&](const Eigen::Vector3d& p) { return edge_mm_at(p, options.face_edge_mm); };
    filling.box = solid.bounds();
    auto mesh = tetrahedralize(filling);
    if (!mesh) return forward(mesh);
    keep_largest_piece(*mesh);
    bones[b] = *std::move(mesh);
  }
  SkullTemplate skull = assembled(bones);

  progress.report(0.9, "outside, mirror map, landmarks");
  const TriangleMesh surface = surface_of(skull, skull.vertices);
  skull.outer = outside_vertices(surface, options.threads);
  const SurfacePlaces places(surface);
  skull.mirror.resize(static_cast<std::size_t>(skull.boundary_count));
  parallel_for(skull.boundary_count, options.threads, [&](int v) {
    Eigen::Vector3d image = surface.vertices.row(v);
    image.x() = -image.x();
    skull.mirror[static_cast<std::size_t>(v)] = places.nearest(image);
  });
  for (const Landmark& landmark : canonical_landmarks()) {
    skull.landmarks.push_back({landmark.name, places.nearest(landmark.position_mm)});
  }
  if (const auto valid = skull.validate(); !valid) return forward(valid);
  return skull;
}

}  // namespace skullstation
