#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/registration/surface_point.h"

namespace skullstation {

using Tetrahedra = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;  // #T x 4

/// Parts of the skull. Left and right are the skull's own. The order is part of the file format.
enum class SkullRegion : std::uint8_t {
  calvaria,  ///< the vault above glabella and opisthocranion
  occiput,
  base,
  temporal_left,
  temporal_right,
  zygoma_left,  ///< with the arch
  zygoma_right,
  orbit_left,
  orbit_right,
  nose,  ///< nasal bones, aperture, septum
  maxilla,
  upper_teeth,
  chin,
  mandible_body_left,
  mandible_body_right,
  ramus_left,  ///< with condyle and coronoid process
  ramus_right,
  lower_teeth
};
inline constexpr int kSkullRegionCount = 18;

/// "orbit left"
std::string_view to_string(SkullRegion region);

/// The two bones that move on their own.
enum class SkullBone : std::uint8_t { cranium, mandible };
SkullBone bone_of(SkullRegion region);

/// The facial area, where the paper measures its fits: everything below the brow that soft tissue
/// covers in front of the ears.
bool is_facial(SkullRegion region);

/// Teeth differ most between people, break, and shine in CT.
bool is_tooth(SkullRegion region);

/// A solid skull that can be deformed onto others, in the anatomical frame [mm] (LPS axes,
/// Frankfurt plane z = 0, origin midway between the porions). Gietzen et al. 2019: about 70,000
/// vertices.
struct SkullTemplate {
  Points3 vertices;       ///< #V x 3; the first `boundary_count` lie on the surface
  Tetrahedra tetrahedra;  ///< #T x 4, of positive volume: (b - a) x (c - a) . (d - a) > 0
  int boundary_count = 0;
  Triangles boundary;               ///< #F x 3 of the surface's vertices, seen from outside ccw
  std::vector<SkullRegion> region;  ///< #V
  /// Surface vertices (#boundary_count) that lie on the outside of the skull: seen from far away in
  /// some direction. Only these carry tissue and are looked for in scans.
  std::vector<bool> outer;
  /// The place of each surface vertex's mirror image (#boundary_count) on the template's surface;
  /// the surface is symmetric in x = 0 up to the length of its edges squared.
  std::vector<SurfacePoint> mirror;
  std::vector<TemplateLandmark> landmarks;  ///< craniometric, bilateral ones " left" / " right"

  /// Indices in range, every tetrahedron of positive volume, tables of the right length.
  Result<void> validate() const;
};

/// The surface of the template with its vertices at `vertices` (#V x 3 or #boundary_count x 3),
/// with normals.
TriangleMesh surface_of(const SkullTemplate& skull, const Points3& vertices);

/// Volumes of the tetrahedra [mm^3], negative where turned inside out.
Eigen::VectorXd signed_volumes(const Tetrahedra& tetrahedra, const Points3& vertices);

/// The mirror image of a skull that the template was fitted to (#V x 3 or #boundary_count x 3):
/// each surface vertex goes to the reflection in x = 0 of its mirror partner. Surface vertices only
/// (#boundary_count x 3).
Points3 mirrored_surface(const SkullTemplate& skull, const Points3& vertices);

}  // namespace skullstation
