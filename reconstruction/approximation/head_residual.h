#pragma once

#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// A distance along the normal that a vertex should move, as far as it is known.
struct WantedShift {
  double mm = 0.0;
  double information = 0.0;  ///< 1 / variance [1/mm^2]; 0: nothing is known
};

/// What a head does beyond its model's modes: a smooth shift along the normals, the most probable
/// one given what is wanted of each vertex and that the model's modes leave `residual_sd_mm` over.
/// It bends over about a centimetre; where nothing is wanted it runs out. #V. The non-rigid stage
/// of Gietzen et al. 2019 with certainties as weights.
Eigen::VectorXd residual_shift_mm(const Triangles& triangles,
                                  const std::vector<WantedShift>& wanted, double residual_sd_mm);

}  // namespace skullstation
