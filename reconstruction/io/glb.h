#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// A way in which the surface may move: a mode of a shape model, for instance.
struct MorphTarget {
  std::string name;
  Points3 displacement_mm;  ///< #V x 3, added to the vertices at weight 1
};

/// Writes a binary glTF 2.0 file (Khronos, ISO/IEC 12113) with one mesh, its normals and colours
/// where it has them. Millimetres with z up and the face towards -y (the anatomical and the table
/// frame) become metres with y up and the face towards +z, as glTF demands. Morph targets keep
/// their names in `extras.targetNames`. Whole or not at all. Fails with `usage` for a morph
/// target of another size.
Result<void> write_glb(const TriangleMesh& mesh, const std::filesystem::path& path,
                       const std::vector<MorphTarget>& morph_targets = {});

/// A picture laid over a mesh.
struct MeshTexture {
  std::vector<Eigen::Vector2f> coordinates;  ///< #V, in [0, 1] from the picture's upper left corner
  std::string image;                         ///< a PNG or JPEG file's bytes, sRGB
};

/// The same with a texture instead of vertex colours; the picture goes into the file as it is.
/// Fails with `usage` for coordinates of another number than the vertices' and for a picture that
/// is neither PNG nor JPEG.
Result<void> write_glb(const TriangleMesh& mesh, const MeshTexture& texture,
                       const std::filesystem::path& path);

}  // namespace skullstation
