#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

struct TetrahedralMesh {
  Points3 vertices;       // #V x 3
  Tetrahedra tetrahedra;  // #T x 4, positive volume
};

struct TetrahedralizationOptions {
  /// Where the solid is: negative inside, about a distance near its surface.
  std::function<double(const Eigen::Vector3d&)> distance_mm;
  Eigen::AlignedBox3d box;  ///< that holds the solid
  /// Length of the surface's edges wanted at a point.
  std::function<double(const Eigen::Vector3d&)> edge_mm;
};

/// Fills a solid with tetrahedra by Delaunay refinement (Boissonnat & Oudot 2005; CGAL Mesh_3), its
/// slivers exuded (Cheng et al. 2000). The same bytes each time. Fails with `no_result` where
/// nothing is inside.
Result<TetrahedralMesh> tetrahedralize(const TetrahedralizationOptions& options);

}  // namespace skullstation
