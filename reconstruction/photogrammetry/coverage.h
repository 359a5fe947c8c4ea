#pragma once

#include <cstdint>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/sights.h"

namespace skullstation {

/// How well each vertex was photographed.
struct Coverage {
  std::vector<std::uint8_t> views;      ///< views that see the vertex
  std::vector<float> ground_sample_mm;  ///< finest size of a photograph's pixel there; 0: unseen
  std::vector<float> accuracy_mm;       ///< estimated standard error along the normal; 0: unseen
  double open_edge_mm = 0.0;            ///< length of the surface's border
};

/// Finds the views that see each vertex. The standard error takes each of n views' depths as
/// matched to `match_sd_px` and the angle between the lines of sight that lie farthest apart:
/// sd = gsd match_sd_px / (2 tan(angle / 2) sqrt(n)) (Kraus 2007, normal case).
/// \pre the mesh has normals
Coverage measure_coverage(const TriangleMesh& mesh, const Sights& sights, double match_sd_px,
                          int threads);

}  // namespace skullstation
