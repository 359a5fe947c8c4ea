#pragma once

#include "core/result.h"
#include "daemon/report/captioned_pictures.h"
#include "reconstruction/volume/ct_surfaces.h"

namespace skullstation {

/// A surface from the front, the left and behind.
Result<CaptionedPictures> surface_pictures(const TriangleMesh& mesh, const Eigen::Vector3d& color,
                                           int threads);

/// Slices all through the head with both surfaces' sections drawn over them, bone in orange, skin
/// in blue: six axial ones from the feet up, three coronal, three sagittal.
CaptionedPictures slice_pictures(const CtSurfaces& surfaces, int threads);

}  // namespace skullstation
