#pragma once

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

struct DecimationOptions {
  double edge_mm = 1.0;  ///< mean edge length of the result
  /// Root mean square distance of a new vertex from the planes that it replaces, at most; finer
  /// relief keeps shorter edges.
  double max_error_mm = 0.15;

  Result<void> validate() const;
};

/// Collapses edges until their lengths are uniform, about `edge_mm`: shortest first, in rounds of
/// growing length, each vertex at most once a round; the new vertex goes where the quadric error
/// is least (Garland & Heckbert 1997, regularised towards the edge's middle). A collapse that would
/// change the topology (link condition, Dey et al. 1999), turn a triangle over, make an edge much
/// longer than `edge_mm` or pass the error is left out; so a closed manifold stays one. Vertices on
/// a boundary stay where they are. Deterministic, single-threaded. Normals and colours are dropped.
TriangleMesh decimated(const TriangleMesh& mesh, const DecimationOptions& options);

}  // namespace skullstation
