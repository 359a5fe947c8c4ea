#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "reconstruction/rendering/mesh_picture.h"

namespace skullstation {

/// From where something is looked at.
struct PictureSide {
  const char* name;
  Eigen::Vector3d from;  ///< out of the middle towards the viewer
  Eigen::Vector3d up;
};

/// Front, left and right three-quarter, left and right profile, back, top and base of a head in the
/// anatomical or patient frame (+x left, +y posterior, +z superior).
std::span<const PictureSide> head_sides();

/// Pictures of equal size in rows of `columns`, row by row. \pre all pictures have the same size
Image8 picture_sheet(std::span<const Image8> pictures, int columns);

/// The meshes from each of the sides, one picture a side, all at the same scale and centred.
Result<std::vector<Image8>> render_sides(std::span<const PicturedMesh> meshes,
                                         std::span<const PictureSide> sides,
                                         const PictureOptions& options);

}  // namespace skullstation
