#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "daemon/report/captioned_pictures.h"
#include "reconstruction/approximation/case_skull.h"
#include "reconstruction/approximation/face_estimate.h"

namespace skullstation {

/// The face from five sides: three-quarter, front, profile of either side.
Result<CaptionedPictures> face_pictures(const TriangleMesh& head,
                                        const ReportPictureOptions& options);

/// The fitted skull, its tissue in colour, the sphere model, the skull inside the face, each from
/// the front and the left.
Result<CaptionedPictures> method_pictures(const TriangleMesh& skull,
                                          const Eigen::VectorXd& tissue_mm,
                                          const TriangleMesh& spheres, const TriangleMesh& head,
                                          const ReportPictureOptions& options);

/// How far the face may be off, in colour, from the front and both three-quarters; vertices that
/// bone does not determine are grey.
Result<CaptionedPictures> uncertainty_pictures(const TriangleMesh& head, const FaceEstimate& face,
                                               double high_mm, const ReportPictureOptions& options);

/// One picture of each head from the front, all at one scale.
Result<CaptionedPictures> variant_pictures(
    const std::vector<std::pair<std::string, TriangleMesh>>& heads,
    const ReportPictureOptions& options);

}  // namespace skullstation
