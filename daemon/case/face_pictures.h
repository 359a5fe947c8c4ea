#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "reconstruction/approximation/case_skull.h"
#include "reconstruction/approximation/face_estimate.h"

namespace skullstation {

struct FacePictureOptions {
  int width_px = 420;  ///< and height
  int samples = 16;    ///< rays a pixel
  int threads = 0;     ///< 0: all
};

using CaptionedPictures = std::vector<std::pair<std::string, Image8>>;

/// A colour for each vertex: from dark blue (`low`) over green to yellow (`high`); grey where the
/// value is not a number. After viridis (Smith & van der Walt 2015), which reads the same in grey
/// and for the colour-blind.
Colors scalar_colors(const Eigen::VectorXd& values, double low, double high);

/// The face from five sides: three-quarter, front, profile of either side.
Result<CaptionedPictures> face_pictures(const TriangleMesh& head,
                                        const FacePictureOptions& options);

/// The fitted skull, its tissue in colour, the sphere model, the skull inside the face, each from
/// the front and the left.
Result<CaptionedPictures> method_pictures(const TriangleMesh& skull,
                                          const Eigen::VectorXd& tissue_mm,
                                          const TriangleMesh& spheres, const TriangleMesh& head,
                                          const FacePictureOptions& options);

/// How far the face may be off, in colour, from the front and both three-quarters; vertices that
/// bone does not determine are grey.
Result<CaptionedPictures> uncertainty_pictures(const TriangleMesh& head, const FaceEstimate& face,
                                               double high_mm, const FacePictureOptions& options);

/// One picture of each head from the front, all at one scale.
Result<CaptionedPictures> variant_pictures(
    const std::vector<std::pair<std::string, TriangleMesh>>& heads,
    const FacePictureOptions& options);

}  // namespace skullstation
