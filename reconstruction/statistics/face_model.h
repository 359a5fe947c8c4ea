#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/result.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/skull_template.h"
#include "reconstruction/statistics/calibration.h"
#include "reconstruction/statistics/joint_model.h"
#include "reconstruction/statistics/shape_model.h"
#include "reconstruction/statistics/tissue_model.h"

namespace skullstation {

/// The way from a bone landmark to its skin landmark, as the training subjects have it.
struct SkinDirection {
  std::string name;                                      ///< of the skull template's landmark
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit, anatomical frame
  double depth_mm = 0.0;                                 ///< mean distance along it
  double depth_sd_mm = 0.0;
};

/// All that the approximation of a face needs to know: the three models of Gietzen et al. 2019 and
/// how they hang together. Everything in the anatomical frame, mm.
struct FaceModel {
  SkullTemplate skull_template;
  HeadTemplate head_template;
  ShapeModel skull;    ///< over the skull template's vertices, inner ones included
  ShapeModel head;     ///< over the head template's vertices
  TissueModel tissue;  ///< over the skull template's surface vertices
  /// Variables "skull 1".., "tissue 1".., "head 1".., "male" (0 or 1), "age [years]",
  /// "body mass index".
  JointModel joint;
  std::vector<SkinDirection> skin_directions;
  std::vector<BandFactor> bands;
  std::string provenance;  ///< JSON: subjects' hashes, options, seed, versions, the model card

  /// The parts are sound and fit together.
  Result<void> validate() const;
};

}  // namespace skullstation
