#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/registration/fit_report.h"
#include "reconstruction/registration/head_template.h"

namespace skullstation {

/// A landmark placed on the input by hand or carried over, named as in the template.
struct InputLandmark {
  std::string name;
  Eigen::Vector3d position_mm;
};

struct HeadRegistrationOptions {
  std::vector<InputLandmark> landmarks;  ///< may be empty: the pose is found then
  /// Where the fit starts, in the input's frame (#V x 3), if something better than the template is
  /// known: the head model's best fit to a cropped scan. 0 rows: the template.
  Points3 start;
  /// Template's pose (input_from_template), if it is known, e.g. that of the same person's skull.
  const Similarity3* pose = nullptr;
  /// Weight of each input vertex in [0, 1]: hair, artefacts, cloth. Empty: all 1.
  std::vector<double> input_weight;
  bool unit_unknown = false;
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

struct HeadFitQuality {
  FitDistances kept;             ///< the input's points that kept a correspondence, to the fit
  double weighted_rms_mm = 0.0;  ///< the paper's figure: over kept points, by weight
  double kept_share = 0.0;       ///< of the input's points over the template's extent
  FitDistances facial;           ///< input points nearest to face, nose, lips or eyes, to the fit
};

struct FittedHead {
  Points3 vertices;  ///< #V x 3 in the template's order, in the input's frame [mm]
  Similarity3 input_from_template;
  std::vector<bool> observed;       ///< #V: the input's surface is within 2 mm, normals agree
  std::vector<double> distance_mm;  ///< #V: to the input's surface
  HeadFitQuality quality;
  FitStages stages;
  std::vector<std::string> warnings;
};

/// Deforms the template onto the input skin (Achenbach et al. 2015, Gietzen et al. 2019): per-edge
/// Laplacian bending with per-edge rotations, stiff to soft. The same bytes for any number of
/// threads. Fails like register_skull.
Result<FittedHead> register_head(const HeadTemplate& head, const TriangleMesh& input,
                                 const HeadRegistrationOptions& options = {},
                                 const Progress& progress = {});

}  // namespace skullstation
