#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace skullstation {

/// Corner c of the unit cube lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge e runs along axis e / 4
/// from its lower corner `kCubeEdges[e][0]` to `kCubeEdges[e][1]`.
inline constexpr std::array<std::array<int, 2>, 12> kCubeEdges = {{{0, 1},
                                                                   {2, 3},
                                                                   {4, 5},
                                                                   {6, 7},
                                                                   {0, 2},
                                                                   {1, 3},
                                                                   {4, 6},
                                                                   {5, 7},
                                                                   {0, 4},
                                                                   {1, 5},
                                                                   {2, 6},
                                                                   {3, 7}}};

/// How a surface cuts a cube: triangles of cut edges, counter-clockwise seen from outside the
/// solid.
using CubeTriangles = std::vector<std::array<int, 3>>;

/// For each of the 256 sets of corners inside the solid (bit c: corner c) its triangles. On a face
/// with two inside corners diagonally across, the inside corners stay apart: a rule that both
/// cubes of the face see alike, which is what keeps the surface closed (Duerst 1988; Montani,
/// Scateni & Scopigno 1994). No triangle's side inside the cube joins two edges of one face, so
/// that a side is never made a second time by the neighbour, which keeps the surface a manifold.
const std::array<CubeTriangles, 256>& solid_cube_cases();

}  // namespace skullstation
