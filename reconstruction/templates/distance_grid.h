#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/phantom/implicit_solid.h"

namespace skullstation {

/// A solid's signed distance, sampled near its surface on a grid and interpolated linearly between
/// its points: what is slow to evaluate becomes quick. Farther from the surface only the sign
/// holds.
class DistanceGrid {
 public:
  /// The same for any number of threads (0: all).
  DistanceGrid(const ImplicitSolid& solid, double cell_mm, int threads);

  double distance_mm(const Eigen::Vector3d& point) const;

 private:
  float at(const Eigen::Array3i& point) const {
    const Eigen::Index row = Eigen::Index{point.z()} * counts_.y() + point.y();
    return values_[static_cast<std::size_t>(row * counts_.x() + point.x())];
  }

  double cell_mm_;
  Eigen::Vector3d origin_;
  Eigen::Array3i counts_;
  std::vector<float> values_;
};

}  // namespace skullstation
