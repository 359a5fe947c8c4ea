#pragma once

#include <span>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/statistics/face_model.h"
#include "reconstruction/statistics/head_from_skull.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

/// A subject's face as the others foretell it from the skull.
struct LeftOut {
  /// Of each head vertex from the true head, along the true normal [mm]: mean head of the others;
  /// conditional on the skull; on the skull, sex, age and body mass index.
  Eigen::VectorXd mean_error_mm;
  Eigen::VectorXd skull_error_mm;
  Eigen::VectorXd full_error_mm;
  /// Predicted standard deviation along the normal [mm], of the last two.
  Eigen::VectorXd skull_sd_mm;
  Eigen::VectorXd full_sd_mm;
};

/// Foretells each subject's head from its skull by the model of all others. `subjects` are aligned.
/// Fails with `bad_input` for fewer than 6 subjects, `cancelled` on request.
Result<std::vector<LeftOut>> leave_one_out(const SkullTemplate& skull, const HeadTemplate& head,
                                           std::span<const ModelSubject> subjects,
                                           const JointScoreOptions& options,
                                           const Progress& progress = {});

/// 80 % bands by region of the head (all of a region's vertices and subjects together), and for
/// "all".
std::vector<BandFactor> calibrated_bands(const HeadTemplate& head,
                                         std::span<const LeftOut> left_out, double level = 0.8);

}  // namespace skullstation
