#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// An inner edge with the flap of its two triangles: Delta x = sum of stencil_i x_(corner i).
struct EdgeFlap {
  std::array<int, 4> corners;  ///< the edge's ends, then the two opposite vertices
  Eigen::Vector4d stencil;     ///< [1/mm^2]
  double share = 0.0;          ///< of the surface's area: (A0 + A1) / 3 over the sum of all
};

/// The per-edge Laplacians of a surface (quadratic bending, Bergou et al. 2006, as Achenbach et al.
/// 2015 use them); edges on a boundary have none.
std::vector<EdgeFlap> edge_flaps(const Points3& rest, const Triangles& triangles);

/// B (#V x #V) with tr(U' B U) = sum share |Delta U|^2.
Eigen::SparseMatrix<double> bending_matrix(const std::vector<EdgeFlap>& flaps,
                                           Eigen::Index vertices);

/// With each edge's rotation R held, sum share |Delta x - R Delta rest|^2 is minimal where B x
/// equals this (#V x 3). R is the best rotation of the edge's flap from `rest` to `now`; planar
/// similarities and rigid motions cost nothing.
Points3 rotated_rest_pull(const std::vector<EdgeFlap>& flaps, const Points3& rest,
                          const Points3& now, int threads);

}  // namespace skullstation
