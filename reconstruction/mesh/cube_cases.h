#pragma once

#include <array>
#include <vector>

namespace skullstation {

/// An edge of the unit cube: from `corner` along `axis`. Corner c lies at (c & 1, c >> 1 & 1,
/// c >> 2 & 1).
struct CubeEdge {
  int corner = 0;
  int axis = 0;

  int far_corner() const { return corner | 1 << axis; }
};

/// The cube's 12 edges; those along x first, then y, then z.
inline constexpr std::array<CubeEdge, 12> cube_edges = {{{0, 0},
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

/// How a surface cuts a cube: triangles of cut edges, counter-clockwise seen from outside the
/// solid.
using CubeTriangles = std::vector<std::array<int, 3>>;

/// For each of the 256 sets of corners inside the solid (bit c: corner c) its triangles.
using CubeCases = std::array<CubeTriangles, 256>;

/// What becomes of two inside corners diagonally across a face whose other corners are outside.
/// Both cubes of the face see it alike, which keeps the surface closed (Duerst 1988; Montani,
/// Scateni & Scopigno 1994).
enum class DiagonalCorners { stay_apart, are_joined };

/// The cases of marching cubes (Lorensen & Cline 1987). No triangle's side inside the cube joins
/// two edges of one face, so that a side is never made a second time by the neighbour, which keeps
/// the surface a manifold.
const CubeCases& cube_cases(DiagonalCorners inside);

}  // namespace skullstation
