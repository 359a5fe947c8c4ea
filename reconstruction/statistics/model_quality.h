#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.h"
#include "reconstruction/statistics/shape_model.h"

namespace skullstation {

/// How good a shape model is with its first M modes (Styner et al. 2003), for M = 1, 2, ...
struct ModelQuality {
  std::vector<double> compactness;  ///< cumulated share of the variance that the modes tell
  /// Mean distance [mm] between corresponding vertices of a shape and its projection onto the model
  /// of all others, and its standard error.
  std::vector<double> generalisation_mm;
  std::vector<double> generalisation_error_mm;
  /// Mean distance [mm] of a random member from the training shape nearest to it.
  std::vector<double> specificity_mm;
};

struct ModelQualityOptions {
  int max_modes = 30;
  int random_members = 1000;
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

/// `vertex_weights` as for build_shape_model; distances are means under them. Leaves one shape out
/// at a time. Fails like build_shape_model.
Result<ModelQuality> model_quality(std::span<const Points3> shapes,
                                   const Eigen::VectorXd& vertex_weights,
                                   const ModelQualityOptions& options = {});

}  // namespace skullstation
