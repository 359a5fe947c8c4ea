#pragma once

#include <Eigen/Core>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

struct SphereModelOptions {
  double grid_mm = 1.0;       ///< edge of the distance field's cells
  double smoothing_mm = 3.0;  ///< of the depths along the bone; 0: as they are
  int threads = 0;            ///< 0: all

  Result<void> validate() const;
};

/// Depths smoothed along a surface by so many millimetres (standard deviation of the equivalent
/// Gaussian); NaN stays NaN and tells its neighbours nothing. A union of spheres takes the largest
/// of noisy depths everywhere, which smoothing prevents.
Eigen::VectorXd smoothed_depths(const TriangleMesh& surface, const Eigen::VectorXd& depths_mm,
                                double smoothing_mm);

/// The sphere model of Gietzen et al. 2019: the surface of the union of spheres round the bone's
/// vertices with the depths of the soft tissue (NaN: no sphere) as radii; seen from outside only,
/// hollows within the union are gone. Closed, each component oriented outwards. By a distance field
/// on a grid. Fails with `bad_input` without spheres, or where the grid would take more than 2^28
/// cells.
Result<TriangleMesh> sphere_model(const Points3& bone, const Eigen::VectorXd& depths_mm,
                                  const SphereModelOptions& options = {});

}  // namespace skullstation
