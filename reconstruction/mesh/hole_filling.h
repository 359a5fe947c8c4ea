#pragma once

#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// A surface with some of its openings closed.
struct FilledSurface {
  /// The old vertices in their order, then copies of those at which an opening pinched the surface,
  /// then new ones; the old triangles in their order, then new ones. No normals and colours.
  TriangleMesh mesh;
  std::vector<int> origin;  ///< of each vertex: the old vertex that it is, or -1 for a new one
  double filled_mm2 = 0.0;  ///< area of the new triangles
  int holes_filled = 0;
  int holes_left = 0;  ///< their rim is longer, or nothing fits in
};

/// Closes every opening whose rim is at most `longest_rim_mm` long by triangles of about the rim's
/// edge length, bent to go on smoothly from the surface around (Liepa 2003; CGAL's
/// triangulate_refine_and_fair_hole). What it makes is a guess, not a measurement.
/// \pre an oriented manifold; it may be pinched at vertices on its border
FilledSurface fill_holes(const TriangleMesh& surface, double longest_rim_mm);

}  // namespace skullstation
