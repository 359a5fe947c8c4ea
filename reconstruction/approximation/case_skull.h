#pragma once

#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "reconstruction/registration/skull_registration.h"
#include "reconstruction/statistics/face_model.h"

namespace skullstation {

/// The skull of a case in the anatomical frame: as it was observed, and elsewhere as it most likely
/// was.
struct CaseSkull {
  Similarity3 anatomical_from_input;  ///< scale 1 unless the input's unit is unknown
  Points3 vertices;                   ///< template vertices x 3 [mm]
  std::vector<bool> observed;         ///< surface vertices that the input shows
  Eigen::VectorXd sd_mm;              ///< surface vertices: how far they may be off
  Belief belief;                      ///< about the skull model's coefficients
  SkullFitQuality quality;
  /// Root mean square of the coefficients [SD]: about 1 for a skull like those the model was made
  /// from, far more for what is no such skull.
  double strangeness = 0.0;
  std::vector<std::string> warnings;
};

/// Fits the model's template to the input skull, without the flat lids that a scan's ends make,
/// brings it into the anatomical frame and completes it from the skull model. Fails as
/// register_skull does, and with `bad_input` for what is too strange to be a skull of the model's
/// kind.
Result<CaseSkull> fit_case_skull(const FaceModel& model, const TriangleMesh& input,
                                 const SkullRegistrationOptions& options = {},
                                 const Progress& progress = {});

}  // namespace skullstation
