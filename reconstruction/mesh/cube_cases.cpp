#include "reconstruction/mesh/cube_cases.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>

namespace skullstation {

namespace {

using Loop = std::vector<int>;

/// The faces' corners, counter-clockwise seen from outside the cube.
constexpr std::array<std::array<int, 4>, 6> kFaces = {
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

int edge_between(int a, int b) {
  const auto between = [&](const CubeEdge& edge) {
    return edge.corner == std::min(a, b) && edge.far_corner() == std::max(a, b);
  };
  return static_cast<int>(std::ranges::find_if(cube_edges, between) - cube_edges.begin());
}

/// The closed polygons in which the surface cuts the cube, as rings of cut edges.
std::vector<Loop> trace_loops(int inside_corners) {
  const auto inside = [&](int corner) { return (inside_corners >> corner & 1) != 0; };
  // Walking round a face, the surface enters it at each edge that leaves the solid and leaves it
  // at the edge before, by which the walk came into that stretch of inside corners: so each
  // stretch is cut off on its own.
  std::array<int, 12> next;
  next.fill(-1);
  for (const std::array<int, 4>& face : kFaces) {
    for (int i = 0; i < 4; ++i) {
      if (inside(face[i]) || !inside(face[(i + 1) % 4])) continue;
      int last = i + 1;
      while (inside(face[(last + 1) % 4])) ++last;
      const int entry = edge_between(face[i], face[(i + 1) % 4]);
      const int exit = edge_between(face[last % 4], face[(last + 1) % 4]);
      next[entry] = exit;
    }
  }
  std::vector<Loop> loops;
  std::array<bool, 12> done{};
  for (int start = 0; start < 12; ++start) {
    if (next[start] < 0 || done[start]) continue;
    Loop loop;
    for (int e = start; !done[e]; e = next[e]) {
      done[e] = true;
      loop.push_back(e);
    }
    loops.push_back(loop);
  }
  return loops;
}

bool on_one_face(int edge_a, int edge_b) {
  for (const std::array<int, 4>& face : kFaces) {
    const auto on_face = [&](int edge) {
      return std::ranges::count(face, cube_edges[edge].corner) == 1 &&
             std::ranges::count(face, cube_edges[edge].far_corner()) == 1;
    };
    if (on_face(edge_a) && on_face(edge_b)) return true;
  }
  return false;
}

/// Cuts ears off the loop until nothing is left; false if no allowed way to do it exists.
bool triangulate(const Loop& loop, CubeTriangles& triangles) {
  const std::size_t n = loop.size();
  if (n == 3) {
    triangles.push_back({loop[0], loop[1], loop[2]});
    return true;
  }
  for (std::size_t tip = 0; tip < n; ++tip) {
    const int before = loop[(tip + n - 1) % n];
    const int after = loop[(tip + 1) % n];
    if (on_one_face(before, after)) continue;
    Loop rest = loop;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(tip));
    triangles.push_back({before, loop[tip], after});
    if (triangulate(rest, triangles)) return true;
    triangles.pop_back();
  }
  return false;
}

CubeCases apart_cases() {
  CubeCases all;
  for (int corners = 0; corners < 256; ++corners) {
    for (const Loop& loop : trace_loops(corners)) {
      const bool possible = triangulate(loop, all[corners]);
      assert(possible);
      static_cast<void>(possible);
    }
  }
  return all;
}

/// Inside corners are joined where outside ones stay apart: solid and outside change places.
CubeCases joined_cases() {
  CubeCases all = apart_cases();
  std::ranges::reverse(all);
  for (CubeTriangles& triangles : all) {
    for (std::array<int, 3>& triangle : triangles) std::swap(triangle[1], triangle[2]);
  }
  return all;
}

}  // namespace

const CubeCases& cube_cases(DiagonalCorners inside) {
  static const CubeCases apart = apart_cases();
  static const CubeCases joined = joined_cases();
  return inside == DiagonalCorners::stay_apart ? apart : joined;
}

}  // namespace skullstation
