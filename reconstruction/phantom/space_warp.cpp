#include "reconstruction/phantom/space_warp.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace skullstation {

namespace {

constexpr int kMostNodes = 64;  ///< along an axis of a grid

/// A grid's bump heights along the three axes at a point.
struct Heights {
  Heights(const BumpGrid& grid, const Eigen::Vector3d& point) {
    const double factor = -0.5 / (grid.width_mm * grid.width_mm);
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < grid.size[axis]; ++i) {
        const double off = point[axis] - grid.origin_mm[axis] - i * grid.spacing_mm;
        along[axis][i] = std::exp(factor * off * off);
      }
    }
  }
  double along[3][kMostNodes];
};

Eigen::Vector3d displacement(const BumpGrid& grid, const Eigen::Vector3d& point) {
  const Heights heights(grid, point);
  const double* node = grid.displacement_mm.data();
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      const double across = heights.along[1][j] * heights.along[2][k];
      for (int i = 0; i < grid.size.x(); ++i, node += 3) {
        const double height = across * heights.along[0][i];
        x += height * node[0];
        y += height * node[1];
        z += height * node[2];
      }
    }
  }
  return {x, y, z};
}

Eigen::Matrix3d slope(const BumpGrid& grid, const Eigen::Vector3d& point) {
  const Heights heights(grid, point);
  const double width2 = grid.width_mm * grid.width_mm;
  Eigen::Matrix3d slope = Eigen::Matrix3d::Zero();
  Eigen::Index node = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      const double across = heights.along[1][j] * heights.along[2][k];
      for (int i = 0; i < grid.size.x(); ++i, ++node) {
        const Eigen::Vector3d offset =
            point - grid.origin_mm - grid.spacing_mm * Eigen::Vector3d(i, j, k);
        slope -= across * heights.along[0][i] / width2 * grid.displacement_mm.col(node) *
                 offset.transpose();
      }
    }
  }
  return slope;
}

}  // namespace

Eigen::VectorXd BumpGrid::heights(int axis, const Eigen::Vector3d& point) const {
  const Heights heights(*this, point);
  return Eigen::Map<const Eigen::VectorXd>(heights.along[axis], size[axis]);
}

Eigen::Vector3d SpaceWarp::operator()(const Eigen::Vector3d& point) const {
  Eigen::Vector3d warped = point + stretch * point + shift_mm;
  for (const BumpGrid& grid : bumps) warped += displacement(grid, point);
  return motion * warped;
}

Eigen::Matrix3d SpaceWarp::jacobian(const Eigen::Vector3d& point) const {
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity() + stretch;
  for (const BumpGrid& grid : bumps) jacobian += slope(grid, point);
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
