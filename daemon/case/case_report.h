#pragma once

#include <string>

#include "core/result.h"
#include "daemon/case/case_folder.h"
#include "daemon/case/face_pictures.h"
#include "daemon/report/report.h"

namespace skullstation {

/// All pictures of a case.
struct CasePictures {
  CaptionedPictures face, method, uncertainty, variants;
};

/// The face and what to think of it in plain words first, then variants, uncertainty,
/// how it was made, landmarks, and all that is needed to make it again.
Report case_report(const FaceModel& model, const CaseSkull& skull, const FaceEstimate& face,
                   const CaseSource& source, const CasePictures& pictures);

/// A landmark's depth, where the skull template has the landmark.
struct LandmarkDepth {
  std::string name;
  double depth_mm = 0.0;
  double sd_mm = 0.0;
  int subjects = 0;
  double model_mean_mm = 0.0;
  double model_sd_mm = 0.0;
};
std::vector<LandmarkDepth> landmark_depths(const FaceModel& model, const FaceEstimate& face);

}  // namespace skullstation
