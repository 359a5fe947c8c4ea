#include "reconstruction/phantom/space_warp.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace skullstation {

namespace {

/// Beyond this many widths a bump moves nothing by a hundred thousandth of its height.
constexpr double kReach = 4.8;

}  // namespace

Eigen::Vector3d SpaceWarp::operator()(const Eigen::Vector3d& point) const {
  Eigen::Vector3d warped = point + stretch * point + shift_mm;
  for (const Bump& bump : bumps) {
    const double ratio2 = (point - bump.center_mm).squaredNorm() / (bump.width_mm * bump.width_mm);
    if (ratio2 < kReach * kReach) warped += std::exp(-0.5 * ratio2) * bump.displacement_mm;
  }
  return motion * warped;
}

Eigen::Matrix3d SpaceWarp::jacobian(const Eigen::Vector3d& point) const {
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity() + stretch;
  for (const Bump& bump : bumps) {
    const Eigen::Vector3d offset = point - bump.center_mm;
    const double width2 = bump.width_mm * bump.width_mm;
    const double ratio2 = offset.squaredNorm() / width2;
    if (ratio2 >= kReach * kReach) continue;
    jacobian -= std::exp(-0.5 * ratio2) / width2 * bump.displacement_mm * offset.transpose();
  }
  return motion.rotation * jacobian;
}

std::optional<Eigen::Vector3d> SpaceWarp::source_of(const Eigen::Vector3d& target) const {
  Eigen::Vector3d point = motion.inverse() * target;
  Eigen::Vector3d miss = target - (*this)(point);
  for (int step = 0; step < 50; ++step) {
    if (miss.norm() < 1e-6) return point;
    const Eigen::Vector3d newton = jacobian(point).inverse() * miss;
    double share = 1.0;
    Eigen::Vector3d next = point + newton;
    Eigen::Vector3d next_miss = target - (*this)(next);
    while (!(next_miss.norm() < miss.norm()) && share > 1e-3) {
      share *= 0.5;
      next = point + share * newton;
      next_miss = target - (*this)(next);
    }
    if (!(next_miss.norm() < miss.norm())) break;
    point = next;
    miss = next_miss;
  }
  if (miss.norm() < 1e-6) return point;
  return std::nullopt;
}

double least_determinant(const SpaceWarp& warp, const Eigen::AlignedBox3d& box, double spacing_mm,
                         int threads) {
  const Eigen::Vector3i cells = (box.sizes() / spacing_mm).array().ceil().cast<int>();
  std::vector<double> least(cells.z() + 1, std::numeric_limits<double>::infinity());
  parallel_for(cells.z() + 1, threads, [&](int k) {
    for (int j = 0; j <= cells.y(); ++j) {
      for (int i = 0; i <= cells.x(); ++i) {
        const Eigen::Vector3d point = box.min() + spacing_mm * Eigen::Vector3d(i, j, k);
        least[k] = std::min(least[k], warp.jacobian(point).determinant());
      }
    }
  });
  return *std::ranges::min_element(least);
}

}  // namespace skullstation
