#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/phantom/implicit_solid.h"

namespace skullstation {

/// What can be varied about the canonical skull where its parts are made; whatever a smooth warp
/// of space can do (size, proportions, asymmetry) is left to warps of the result.
struct SkullShape {
  /// Turn of the mandible about the axis through its condyles; 0: teeth in contact. In [0, 35].
  double mandible_opening_deg = 0.0;
  /// Moves the inner table of the vault: thickness added everywhere, in [-3, 3].
  double extra_vault_thickness_mm = 0.0;
  /// Teeth lost with their sockets healed, in FDI two-digit notation (11 .. 17, 21 .. 27, 31 .. 37,
  /// 41 .. 47: an adult without third molars).
  std::vector<int> missing_teeth;
};

/// A tooth of the canonical skull, as its two strokes lie.
struct Tooth {
  int fdi = 0;  ///< two-digit notation
  bool upper = false;
  Eigen::Vector3d crown_mm;  ///< the crown's centre, in the anatomical frame, the jaw closed
  Eigen::Vector3d root_mm;   ///< the root's centre, deep in the bone
};

/// The 28 teeth.
std::vector<Tooth> canonical_teeth();

/// The two bones that come apart: the cranium with the upper teeth, the mandible with the lower.
struct SkullSolids {
  std::unique_ptr<ImplicitSolid> cranium;
  std::unique_ptr<ImplicitSolid> mandible;
};

/// The skull of the given shape in the anatomical frame [mm]: LPS axes (+x left, +y posterior, +z
/// superior), Frankfurt plane z = 0, origin midway between the porions. Between the bones stays a
/// gap of 0.4 mm where they would touch.
/// \pre the shape's values lie in their ranges
SkullSolids skull_solids(const SkullShape& shape = {});

/// How the mandible moves from teeth in contact: model_from_closed.
Rigid3 mandible_opening(double opening_deg);

/// Signed distance [mm] to the bone of the whole skull, negative inside.
double skull_distance_mm(const SkullSolids& skull, const Eigen::Vector3d& point);

struct SkullMeshes {
  TriangleMesh cranium;
  TriangleMesh mandible;
};

/// Closed manifold surfaces with normals, outer and inner surfaces of the bone alike, on a grid of
/// `edge_mm` in [0.2, 20], each bone in one piece: pockets sealed inside the bone are filled, which
/// touches none of the sinuses (they open into the nose). The same bytes for any number of threads
/// (0: all).
SkullMeshes skull_meshes(const SkullSolids& skull, double edge_mm, int threads);

/// Both bones in one mesh: first the cranium's vertices and triangles, then the mandible's.
TriangleMesh whole_skull(const SkullMeshes& skull);

/// The canonical skull in one mesh, as whole_skull.
TriangleMesh canonical_skull(double edge_mm, int threads);

}  // namespace skullstation
