#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace skullstation {

/// An edge of the unit cube: from `corner` along `axis`. Corner c lies at x = c & 1, y = c >> 1 &
/// 1, z = c >> 2.
struct CubeEdge {
  int corner = 0;
  int axis = 0;
};

/// The cube's 12 edges; those along x first, then y, then z.
constexpr std::array<CubeEdge, 12> cube_edges = {{{0, 0},
                                                  {2, 0},
                                                  {4, 0},
                                                  {6, 0},
                                                  {0, 1},
                                                  {1, 1},
                                                  {4, 1},
                                                  {5, 1},
                                                  {0, 2},
                                                  {1, 2},
                                                  {2, 2},
                                                  {3, 2}}};

/// For each of the 256 sets of corners above the threshold (bit c: corner c) the triangles that
/// part them from the others, as triples of edge numbers, counter-clockwise seen from below the
/// threshold. Made by following the contours on the faces, where corners above the threshold that
/// face each other across a face are joined; no triangle's side lies across a face, so that
/// neighbouring cubes never share one that they should not.
const std::array<std::vector<std::uint8_t>, 256>& joining_cube_cases();

}  // namespace skullstation
