#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/surface_colors.h"

namespace skullstation {

struct TextureOptions {
  /// Of the atlas, which is square: the smallest power of 2 that holds the photographs' full
  /// resolution, at most this; beyond it the texture gets coarser [px].
  int largest_side_px = 4096;
  int threads = 0;

  Result<void> validate() const;
};

/// A surface with its photographs' colours as a texture.
struct TexturedSurface {
  TriangleMesh mesh;  ///< vertices along seams appear once for each side; normals, no colours
  /// One for each vertex, in [0, 1], from the atlas's upper left corner (glTF's order).
  std::vector<Eigen::Vector2f> coordinates;
  Image8 atlas;  ///< sRGB
};

/// Lays the surface out on an atlas (`cut_charts`) and colours each texel by the photographs that
/// its triangle's corners mix, so that no seam shows. Triangles that no view sees are mid grey.
/// The same bytes for any number of threads.
/// \pre `colors` were made of this mesh and these sights; the mesh has normals
Result<TexturedSurface> make_texture(const TriangleMesh& mesh, const Sights& sights,
                                     const SurfaceColors& colors, const TextureOptions& options);

}  // namespace skullstation
