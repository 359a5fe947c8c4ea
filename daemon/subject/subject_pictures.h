#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "reconstruction/volume/ct_surfaces.h"

namespace skullstation {

using CaptionedPictures = std::vector<std::pair<std::string, Image8>>;

/// A surface from the front, the left and behind.
Result<CaptionedPictures> surface_pictures(const TriangleMesh& mesh, const Eigen::Vector3d& color,
                                           int threads);

/// Slices all through the head with both surfaces' sections drawn over them, bone in orange, skin
/// in blue: six axial ones from the feet up, three coronal, three sagittal.
CaptionedPictures slice_pictures(const CtSurfaces& surfaces, int threads);

}  // namespace skullstation
