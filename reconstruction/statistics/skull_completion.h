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
};

/// The most likely skull given the observed vertices of a fitted one (#V x 3, aligned with the
/// model), which stay. People differ from the model's modes by a few millimetres, alike over some
/// centimetres; so the modes are the trend and the rest a Gaussian process on the template
/// (universal kriging; Cressie 1993, section 3.4). Nothing observed: the model's mean.
CompletedSkull completed_skull(const SkullTemplate& skull, const ShapeModel& model,
                               const Points3& vertices, const std::vector<bool>& observed);

}  // namespace skullstation
