#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/registration/skull_template.h"
#include "reconstruction/statistics/shape_model.h"

namespace skullstation {

/// A skull with what was not observed where it most likely is.
struct CompletedSkull {
  Points3 vertices;       ///< template's vertices x 3 [mm]
  Eigen::VectorXd sd_mm;  ///< surface vertices: in any one direction; 0 where observed
  /// #modes x #modes: how far the completed skull's coefficients [SD] may be off for what is
  /// missing.
  Eigen::MatrixXd coefficient_covariance;
};

/// The most likely skull given the observed vertices of a fitted one (#V x 3, aligned with the
/// model), which stay. A Gaussian process on the template: its covariance is the model's, damped
/// with the distance, since what few subjects seem to tell of one place from another far away is
/// mostly chance (localisation: Houtekamer & Mitchell 2001, Wilms et al. 2017), and that of the
/// millimetres by which people differ from the model's modes. Nothing observed: the model's mean.
CompletedSkull completed_skull(const SkullTemplate& skull, const ShapeModel& model,
                               const Points3& vertices, const std::vector<bool>& observed);

}  // namespace skullstation
