#pragma once

#include <functional>

#include "core/triangle_mesh.h"

namespace skullstation {

/// The part of a mesh on the side of a plane that `normal` points to: normal . x >= offset. Cut
/// triangles end in the plane; vertices within `snap_mm` of it are moved into it.
TriangleMesh clipped(const TriangleMesh& mesh, const Eigen::Vector3d& normal, double offset,
                     double snap_mm);

struct RemeshingOptions {
  /// Length wanted for edges at a point [mm].
  std::function<double(const Eigen::Vector3d&)> edge_mm;
  /// Moves a point onto the surface that the mesh stands for, and into the planes that it must not
  /// leave; gets the point's place before the step.
  std::function<Eigen::Vector3d(const Eigen::Vector3d& point, const Eigen::Vector3d& before)>
      project;
  /// Vertices of a boundary that stay where they are: where it turns. Empty: none.
  std::function<bool(const Eigen::Vector3d& point)> is_corner;
  int rounds = 8;
};

/// Even triangles of given size (Botsch & Kobbelt 2004, with a size that varies): long edges are
/// split, short ones collapsed, edges flipped where that makes triangles rounder, vertices moved to
/// the middle of their neighbours and back onto the surface. Vertices on a boundary stay on it. The
/// mesh must be an oriented manifold with or without boundary; so is the result. Deterministic.
TriangleMesh remeshed(const TriangleMesh& mesh, const RemeshingOptions& options);

}  // namespace skullstation
