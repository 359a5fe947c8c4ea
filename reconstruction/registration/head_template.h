#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/registration/surface_point.h"

namespace skullstation {

/// Parts of the head's skin. The order is part of the file format.
enum class HeadRegion : std::uint8_t {
  face,  ///< forehead, cheeks, chin, all that is none of the others
  nose,
  lips,
  eyes,  ///< lids and eyeballs
  ears,
  scalp,  ///< where hair grows
  neck
};
inline constexpr int kHeadRegionCount = 7;

std::string_view to_string(HeadRegion region);

/// The face with nose, lips and eyes, by which fits and approximations are judged; not ears, scalp
/// and neck.
bool is_facial(HeadRegion region);

/// Skin that lies over bone, at a depth that can be known: face and scalp.
bool rests_on_bone(HeadRegion region);

/// A head's skin that can be deformed onto others, in the anatomical frame of the skull template
/// [mm]; bald, lids and mouth closed, open at the neck. Gietzen et al. 2019: about 6,000 vertices.
struct HeadTemplate {
  Points3 vertices;                ///< #V x 3
  Triangles triangles;             ///< #F x 3, seen from outside ccw
  std::vector<HeadRegion> region;  ///< #V
  std::vector<int> mirror;         ///< #V: the vertex at the mirror image; its own on x = 0
  /// #V in [0, 1]: how far data near this vertex may be believed: hair, ears and the neck's end
  /// less than bare skin.
  std::vector<double> data_weight;
  std::vector<TemplateLandmark> landmarks;  ///< canonical_skin_landmarks() by name

  Result<void> validate() const;
};

/// The template's surface with its vertices at `vertices` (#V x 3), with normals.
TriangleMesh surface_of(const HeadTemplate& head, const Points3& vertices);

/// The mirror image of a head that the template was fitted to (#V x 3).
Points3 mirrored(const HeadTemplate& head, const Points3& vertices);

}  // namespace skullstation
