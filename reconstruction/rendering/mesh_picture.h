#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "core/image.h"
#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/rendering/picture_camera.h"

namespace skullstation {

/// A mesh in a picture. Its own vertex colours win over `color`.
struct PicturedMesh {
  const TriangleMesh* mesh = nullptr;
  Eigen::Vector3d color{0.86, 0.82, 0.74};  ///< sRGB in [0, 1]; bone
  double opacity = 1.0;                     ///< below 1: what lies behind shines through
};

inline const Eigen::Vector3d skin_color{0.80, 0.66, 0.58};

struct PictureOptions {
  int width = 800;
  int height = 800;
  int samples = 16;                              ///< rays a pixel, in [1, 256]
  Eigen::Vector3d background{0.95, 0.95, 0.96};  ///< sRGB in [0, 1]
  int threads = 0;                               ///< 0: all

  Result<void> validate() const;
};

/// A picture (RGB) of meshes in matte paint under soft light: a large lamp beyond the viewer's left
/// shoulder, a faint one on the right, and light from all round that does not reach into hollows
/// (ambient occlusion). The same bytes for any number of threads. Fails with `usage` for options
/// out of range, `bad_input` for a mesh whose triangles name vertices that do not exist.
Result<Image8> render_picture(std::span<const PicturedMesh> meshes, const PictureCamera& camera,
                              const PictureOptions& options = {});

}  // namespace skullstation
