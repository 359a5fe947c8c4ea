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
  std::vector<float> accuracy_mm;       ///< standard error along the normal (depth_scatter.h)
  double open_edge_mm = 0.0;            ///< length of the surface's border
};

/// Finds the views that see each vertex; `accuracy_mm` is taken over.
/// \pre the mesh has normals
Coverage measure_coverage(const TriangleMesh& mesh, const Sights& sights,
                          std::vector<float> accuracy_mm, int threads);

}  // namespace skullstation
