#include "reconstruction/volume/cube_cases.h"

#include <algorithm>
#include <optional>

namespace skullstation {

namespace {

/// The corners of each face, counter-clockwise seen from outside the cube.
constexpr std::array<std::array<int, 4>, 6> cube_faces = {
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

using Loop = std::vector<int>;  // edge numbers

int edge_between(int a, int b) {
  const int low = std::min(a, b);
  const int difference = std::max(a, b) - low;
  const int axis = difference == 1 ? 0 : difference == 2 ? 1 : 2;
  for (int edge = 0; edge < 12; ++edge) {
    const CubeEdge& candidate = cube_edges[static_cast<std::size_t>(edge)];
    if (candidate.corner == low && candidate.axis == axis) return edge;
  }
  return -1;
}

bool is_above(int corners, int corner) { return (corners >> corner & 1) != 0; }

/// Whether both edges belong to one face.
bool share_face(int edge_a, int edge_b) {
  return std::ranges::any_of(cube_faces, [&](const std::array<int, 4>& face) {
    int found = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const int edge = edge_between(face[i], face[(i + 1) % 4]);
      found += edge == edge_a || edge == edge_b ? 1 : 0;
    }
    return found == 2;
  });
}

/// The closed contours on the cube's surface. Going round a face counter-clockwise, a contour leads
/// from where the way comes back above the threshold to where it went below: across the corners
/// below, which joins those above.
std::vector<Loop> contours(int corners) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : cube_faces) {
    for (std::size_t i = 0; i < 4; ++i) {
      if (!is_above(corners, face[i]) || is_above(corners, face[(i + 1) % 4])) continue;
      std::size_t back = (i + 1) % 4;
      while (!is_above(corners, face[(back + 1) % 4])) back = (back + 1) % 4;
      const int down = edge_between(face[i], face[(i + 1) % 4]);
      const int up = edge_between(face[back], face[(back + 1) % 4]);
      next[static_cast<std::size_t>(up)] = down;
    }
  }
  std::vector<Loop> loops;
  std::array<bool, 12> done{};
  for (int start = 0; start < 12; ++start) {
    if (next[static_cast<std::size_t>(start)] < 0 || done[static_cast<std::size_t>(start)])
      continue;
    Loop loop;
    for (int edge = start; !done[static_cast<std::size_t>(edge)];
         edge = next[static_cast<std::size_t>(edge)]) {
      done[static_cast<std::size_t>(edge)] = true;
      loop.push_back(edge);
    }
    loops.push_back(loop);
  }
  return loops;
}

/// Cuts the polygon loop[first..last] into triangles none of whose inner sides lies on a face.
std::optional<std::vector<std::uint8_t>> triangulated(const Loop& loop, std::size_t first,
                                                      std::size_t last) {
  if (last < first + 2) return std::vector<std::uint8_t>{};
  const auto inner_side_ok = [&](std::size_t a, std::size_t b) {
    const bool on_polygon = b == a + 1 || (a == 0 && b + 1 == loop.size());
    return on_polygon || !share_face(loop[a], loop[b]);
  };
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    if (!inner_side_ok(first, apex) || !inner_side_ok(apex, last)) continue;
    auto before = triangulated(loop, first, apex);
    auto after = triangulated(loop, apex, last);
    if (!before || !after) continue;
    for (const std::size_t corner : {first, apex, last}) {
      before->push_back(static_cast<std::uint8_t>(loop[corner]));
    }
    before->insert(before->end(), after->begin(), after->end());
    return before;
  }
  return std::nullopt;
}

std::array<std::vector<std::uint8_t>, 256> make_cases() {
  std::array<std::vector<std::uint8_t>, 256> cases;
  for (int corners = 0; corners < 256; ++corners) {
    auto& triangles = cases[static_cast<std::size_t>(corners)];
    for (const Loop& loop : contours(corners)) {
      const auto piece = triangulated(loop, 0, loop.size() - 1);
      triangles.insert(triangles.end(), piece.value().begin(), piece.value().end());
    }
  }
  return cases;
}

}  // namespace

const std::array<std::vector<std::uint8_t>, 256>& joining_cube_cases() {
  static const auto cases = make_cases();
  return cases;
}

}  // namespace skullstation
