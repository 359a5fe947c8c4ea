#pragma once

#include <algorithm>
#include <cmath>

#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation::testing {

/// A head of ellipsoids, tubes and plates, in patient coordinates [mm] about the brain's middle:
/// what each step of the extraction must tell apart, with known places. Not a phantom: no one would
/// take it for a face.
struct AnalyticHead {
  bool mandible = true;
  bool head_rest = true;
  bool spine = true;
  bool metal = false;

  static double ellipsoid(const Eigen::Vector3d& p, const Eigen::Vector3d& center,
                          const Eigen::Vector3d& axes) {
    return (p - center).cwiseQuotient(axes).norm();
  }

  static bool in_skull(const Eigen::Vector3d& p) {
    const bool shell =
        ellipsoid(p, {0, 0, 0}, {68, 88, 68}) < 1.0 && ellipsoid(p, {0, 0, 0}, {62, 82, 62}) > 1.0;
    return shell && !(p.z() < 0.0 && std::hypot(p.x(), p.y() - 20.0) < 16.0);
  }
  /// A horseshoe with two rami that reach up to the skull.
  static bool in_mandible(const Eigen::Vector3d& p) {
    const double arch = std::hypot(p.x() / 48.0, (p.y() + 15.0) / 60.0);
    const bool body = p.y() < -15.0 && std::abs(arch - 1.0) < 0.09 && p.z() > -105 && p.z() < -88;
    const bool ramus = std::abs(std::abs(p.x()) - 48.0) < 4.0 && std::abs(p.y() + 12.0) < 7.0 &&
                       p.z() > -105 && p.z() < -44;
    return body || ramus;
  }
  /// A tube round the canal below the foramen magnum.
  static bool in_spine(const Eigen::Vector3d& p) {
    const double radius = std::hypot(p.x(), p.y() - 20.0);
    return p.z() < -74.0 && radius > 12.0 && radius < 24.0;
  }
  /// Two joints between skull and spine, of less dense bone.
  static bool in_joint(const Eigen::Vector3d& p) {
    return p.z() < -60.0 && p.z() > -76.0 && std::hypot(std::abs(p.x()) - 19.0, p.y() - 14.0) < 5.0;
  }
  static bool in_ear(const Eigen::Vector3d& p) {
    return std::abs(p.x()) > 70.0 && std::abs(p.x()) < 96.0 && std::abs(p.y() - 10.0) < 2.5 &&
           std::abs(p.z()) < 20.0;
  }
  /// A round cavity between skin and skull, and the nostril that leads into it.
  static Eigen::Vector3d airway() { return {0.0, -83.0, -32.0}; }
  static bool in_airway(const Eigen::Vector3d& p) {
    const bool nostril = std::hypot(p.x(), p.z() + 32.0) < 4.0 && p.y() < airway().y();
    return nostril || (p - airway()).norm() < 7.0;
  }
  static bool in_skin(const Eigen::Vector3d& p) {
    return ellipsoid(p, {0, -2, 0}, {80, 102, 82}) < 1.0 ||
           ellipsoid(p, {0, -25, -70}, {66, 68, 50}) < 1.0 ||
           (p.z() < -50.0 && std::hypot(p.x(), p.y() - 12.0) < 55.0) ||
           (p - Eigen::Vector3d(0, -106, -30)).norm() < 15.0 || in_ear(p);
  }
  /// A curved shell that touches the head from behind.
  static bool in_head_rest(const Eigen::Vector3d& p) {
    const double radius = std::hypot(p.x(), p.y() + 29.0);
    return p.y() > 40.0 && radius > 129.0 && radius < 133.0;
  }
  static constexpr double metal_x = 48.0;
  static constexpr double metal_y = -30.0;
  static bool in_streaked_slices(const Eigen::Vector3d& p) { return p.z() > -99 && p.z() < -92; }

  double hu(const Eigen::Vector3d& p) const {
    if (metal && in_streaked_slices(p)) {
      if (std::hypot(p.x() - metal_x, p.y() - metal_y) < 4.0) return 3000.0;
      if (p.x() > metal_x && p.x() < 84.0 && std::abs(p.y() - metal_y) < 2.0) return 1500.0;
    }
    double value = -1000.0;
    if (head_rest && in_head_rest(p)) value = 200.0;
    if (in_skin(p) && !in_airway(p)) {
      value = 40.0;
      if (metal && in_streaked_slices(p)) value += 90.0 * std::sin(1.9 * p.x() + 0.7 * p.y());
      if (in_skull(p)) value = 1200.0;
      if (spine && in_joint(p) && value < 700.0) value = 700.0;
      if (spine && in_spine(p)) value = 900.0;
      if (mandible && in_mandible(p)) value = 1300.0;
    }
    return value;
  }

  /// Sampled at `voxel_mm`, from z = `bottom_mm` to `top_mm` and y = `front_mm` on.
  Volume volume(double voxel_mm = 2.0, double bottom_mm = -140.0, double top_mm = 92.0,
                double front_mm = -130.0) const {
    VoxelGrid grid;
    grid.spacing_mm.setConstant(voxel_mm);
    grid.origin_mm = {-139.0, front_mm, bottom_mm};
    const Eigen::Vector3d extent(278.0, 112.0 - front_mm, top_mm - bottom_mm);
    grid.size = (extent / voxel_mm).array().round().cast<int>() + 1;
    return sampled(grid, [&](const Eigen::Vector3d& p) { return hu(p); });
  }
};

}  // namespace skullstation::testing
