#pragma once

#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/statistics/face_model.h"
#include "reconstruction/statistics/leave_one_out.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

struct FaceModelOptions {
  ShapeModelOptions skull;
  ShapeModelOptions head;
  TissueModelOptions tissue;
  JointScoreOptions joint;

  Result<void> validate() const;
};

/// The three models of Gietzen et al. 2019 and the joint one from fitted subjects: alignment,
/// completion of cropped skulls, principal components, tissue statistics of both halves of the face
/// together (each subject and its mirror image), joint Gaussian, bone-to-skin directions, bands
/// that were calibrated leaving one subject out. `provenance` goes into the model as it is. Fails
/// with `bad_input` for fewer than 6 subjects, two that are the same, or one whose tables don't fit
/// the templates; `cancelled` on request.
Result<FaceModel> build_face_model(const SkullTemplate& skull, const HeadTemplate& head,
                                   std::vector<ModelSubject> subjects,
                                   const FaceModelOptions& options, std::string provenance,
                                   const Progress& progress = {});

}  // namespace skullstation
