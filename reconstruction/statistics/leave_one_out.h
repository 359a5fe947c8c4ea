#pragma once

#include <span>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/statistics/face_model.h"
#include "reconstruction/statistics/head_from_skull.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

/// How far off a subject's face was foretold.
struct ForetoldErrors {
  Eigen::VectorXd head_mm;     ///< of each head vertex from the true head, along the true normal
  Eigen::VectorXd head_sd_mm;  ///< as it was predicted, along the normal
  double tissue_mm = 0.0;      ///< mean absolute error of the depths
};

/// A subject's face as the others foretell it.
struct LeftOut {
  ForetoldErrors mean;         ///< from nothing: the others' mean head, everyone's mean depths
  ForetoldErrors given_skull;  ///< from the skull
  ForetoldErrors given_all;    ///< from skull, sex, age and body mass index
};

/// Foretells each subject's head and tissue by the models of all others. `subjects` are aligned.
/// `tissue` is the model of all of them, since it takes longest and leaving one out of its modes
/// changes nothing (2.470 against 2.468 mm of a face's mean error). Fails with `bad_input` for
/// fewer than 6 subjects, `cancelled` on request.
Result<std::vector<LeftOut>> leave_one_out(const SkullTemplate& skull, const HeadTemplate& head,
                                           std::span<const ModelSubject> subjects,
                                           const TissueModel& tissue,
                                           const JointScoreOptions& options = {},
                                           const Progress& progress = {});

/// Mean absolute error over the facial vertices; `errors_mm` are those of all head vertices.
double mean_facial_error_mm(const HeadTemplate& head, const Eigen::VectorXd& errors_mm);

/// 80 % bands by region of the head (all of a region's vertices and subjects together), and for
/// "all".
std::vector<BandFactor> calibrated_bands(const HeadTemplate& head,
                                         std::span<const LeftOut> left_out, double level = 0.8);

}  // namespace skullstation
