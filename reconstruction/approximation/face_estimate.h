#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/approximation/case_skull.h"
#include "reconstruction/approximation/sphere_model.h"
#include "reconstruction/statistics/face_model.h"
#include "reconstruction/statistics/person_facts.h"

namespace skullstation {

/// Where the depths of the soft tissue come from.
enum class TissueChoice {
  conditional,  ///< the joint model, given skull and facts
  population,   ///< the mean over all subjects, as in the paper
  measured      ///< the subject's own, for tests of the method
};

/// A depth of the soft tissue that is known from elsewhere: a table, an ultrasound, a needle.
struct KnownDepth {
  SurfacePoint bone;  ///< on the skull template's surface
  double depth_mm = 0.0;
  double sd_mm = 1.0;
};

struct FaceOptions {
  TissueChoice tissue = TissueChoice::conditional;
  Eigen::VectorXd measured_mm;  ///< skull surface vertices, NaN: unknown; for `measured`
  PersonFacts facts;
  /// For `conditional`: what the model foretells is bent to agree with them, as far as they are
  /// certain.
  std::vector<KnownDepth> known_depths;
  /// Nose and eyes are drawn to where published rules expect them, as far as these are certain; not
  /// with the population's depths, the paper's method.
  bool feature_rules = true;
  SphereModelOptions spheres;
  int rounds = 6;          ///< of correspondences between head and sphere model
  bool variations = true;  ///< find out how the face may vary, too
  int threads = 0;         ///< 0: all

  Result<void> validate() const;
};

/// One direction in which the face may differ: added to the head for each standard deviation. Made
/// of faces that were fitted anew `reach_sd` above and below.
struct FaceVariation {
  static constexpr double reach_sd = 2.0;

  std::string name;           ///< "tissue 1", "body mass index"
  Points3 per_sd_mm;          ///< head vertices x 3
  double sd_unit = 1.0;       ///< what a standard deviation is in the variable's own unit
  double refit_gap_mm = 0.0;  ///< from the faces fitted anew there, mean over the vertices
};

/// What a published rule says of a feature that no bone carries, and what the face has.
struct FeatureFinding {
  std::string name;
  std::string source;  ///< author and year
  double expected_mm = 0.0;
  std::optional<double> sd_mm;       ///< nothing: none is known
  std::optional<double> in_face_mm;  ///< nothing: can't be told on the head
  bool used = false;                 ///< the face was drawn to it
};

/// A face, how it may vary, and how far it may be off. Anatomical frame.
struct FaceEstimate {
  Eigen::VectorXd tissue_mm;     ///< skull surface vertices, NaN where not modelled
  Eigen::VectorXd tissue_sd_mm;  ///< same
  TriangleMesh spheres;
  Points3 head;                 ///< head template's vertices x 3
  Eigen::VectorXd sd_mm;        ///< head vertices: along the normal
  Eigen::VectorXd band_mm;      ///< half width of the calibrated 80 % band
  std::vector<bool> from_bone;  ///< head vertices whose depth over bone carries them; the others
                                ///< (nose, lips, eyes, ears) follow from the model alone
  std::vector<FeatureFinding> features;
  std::vector<FaceVariation> variations;
  std::vector<std::string> warnings;
};

/// The face over a case's skull (Gietzen et al. 2019; the joint model of docs/faces.md). Fails
/// with `bad_input` for facts out of range, `cancelled` on request.
Result<FaceEstimate> estimate_face(const FaceModel& model, const CaseSkull& skull,
                                   const FaceOptions& options = {}, const Progress& progress = {});

}  // namespace skullstation
