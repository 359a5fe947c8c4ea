#include "reconstruction/phantom/warp_basis.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace skullstation {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

const Vector3d kMirror(-1.0, 1.0, 1.0);

/// The height of every bump of the grid at a point.
Eigen::VectorXd node_heights(const BumpGrid& grid, const Vector3d& point) {
  const Eigen::VectorXd x = grid.heights(0, point);
  const Eigen::VectorXd y = grid.heights(1, point);
  const Eigen::VectorXd z = grid.heights(2, point);
  Eigen::VectorXd heights(grid.size.prod());
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      heights.segment((k * grid.size.y() + j) * grid.size.x(), grid.size.x()) = y[j] * z[k] * x;
    }
  }
  return heights;
}

}  // namespace

WarpBasis::WarpBasis(const Eigen::AlignedBox3d& box, const WarpBasisOptions& options) {
  add_affine(options);
  for (const BumpLayer& layer : options.layers) add_layer(box, layer, options.asymmetric_share);
}

void WarpBasis::add_affine(const WarpBasisOptions& options) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      // Mirroring keeps an entry that joins x with itself or y and z with each other.
      const bool symmetric = (row == 0) == (column == 0);
      Mode mode;
      mode.stretch(row, column) = 1.0;
      mode.sd = options.stretch_sd * (symmetric ? 1.0 : options.asymmetric_share);
      if (row != column) mode.sd *= 0.5;
      modes_.push_back(mode);
    }
    Mode shift;
    shift.shift_mm[row] = 1.0;
    shift.sd = options.shift_sd_mm * (row == 0 ? options.asymmetric_share : 1.0);
    modes_.push_back(shift);
  }
}

void WarpBasis::add_layer(const Eigen::AlignedBox3d& box, const BumpLayer& layer,
                          double asymmetric_share) {
  // On a grid of spacing h the squares of bumps of width s add up to (sqrt(pi) s / h)^3.
  const double together =
      std::pow(std::sqrt(std::numbers::pi) * layer.width_mm / layer.spacing_mm, 1.5);
  const double sd = layer.sd_mm / together;
  const Vector3d first = box.min().cwiseQuotient(Vector3d::Constant(layer.spacing_mm));
  const Vector3d last = box.max().cwiseQuotient(Vector3d::Constant(layer.spacing_mm));
  // Only as much of the grid as is covered.
  Eigen::AlignedBox3i used;
  std::vector<Eigen::Vector3i> covered;
  for (int k = static_cast<int>(std::ceil(first.z())); k <= last.z(); ++k) {
    for (int j = static_cast<int>(std::ceil(first.y())); j <= last.y(); ++j) {
      for (int i = 0; i <= last.x(); ++i) {
        const Eigen::Vector3i node(i, j, k);
        if (!layer.covers(layer.spacing_mm * node.cast<double>())) continue;
        covered.push_back(node);
        used.extend(node);
        used.extend(Eigen::Vector3i(-i, j, k));
      }
    }
  }
  if (covered.empty()) return;
  BumpGrid grid;
  grid.origin_mm = layer.spacing_mm * used.min().cast<double>();
  grid.spacing_mm = layer.spacing_mm;
  grid.width_mm = layer.width_mm;
  grid.size = used.sizes().array() + 1;
  grid.displacement_mm = Eigen::Matrix3Xd::Zero(3, grid.size.prod());
  const auto index = [&](const Eigen::Vector3i& node) {
    const Eigen::Vector3i at = node - used.min();
    return Eigen::Index{(at.z() * grid.size.y() + at.y()) * grid.size.x() + at.x()};
  };
  for (const Eigen::Vector3i& node : covered) {
    Mode mode;
    mode.grid = static_cast<int>(bumps_.size());
    mode.node = index(node);
    mode.mirror = index({-node.x(), node.y(), node.z()});
    for (mode.axis = 0; mode.axis < 3; ++mode.axis) {
      for (const double mirror_sign : {1.0, -1.0}) {
        // In the midsagittal plane displacements along x are lopsided, the others are not.
        if (mode.node == mode.mirror && mirror_sign != kMirror[mode.axis]) continue;
        mode.mirror_sign = mirror_sign;
        mode.sd = sd * (mirror_sign > 0.0 ? 1.0 : asymmetric_share);
        modes_.push_back(mode);
      }
    }
  }
  bumps_.push_back(std::move(grid));
}

Eigen::Matrix3Xd WarpBasis::displacements(const Vector3d& point) const {
  std::vector<Eigen::VectorXd> heights;
  heights.reserve(bumps_.size());
  for (const BumpGrid& grid : bumps_) heights.push_back(node_heights(grid, point));
  Eigen::Matrix3Xd displacements(3, size());
  for (int m = 0; m < size(); ++m) {
    const Mode& mode = modes_[m];
    if (mode.grid < 0) {
      displacements.col(m) = mode.sd * (mode.stretch * point + mode.shift_mm);
      continue;
    }
    double height = heights[mode.grid][mode.node];
    if (mode.mirror != mode.node) {
      height += mode.mirror_sign * kMirror[mode.axis] * heights[mode.grid][mode.mirror];
    }
    displacements.col(m) = mode.sd * height * Vector3d::Unit(mode.axis);
  }
  return displacements;
}

SpaceWarp WarpBasis::warp(const Eigen::VectorXd& coefficients) const {
  SpaceWarp warp;
  warp.bumps = bumps_;
  for (int m = 0; m < size(); ++m) {
    const Mode& mode = modes_[m];
    const double value = mode.sd * coefficients[m];
    if (mode.grid < 0) {
      warp.stretch += value * mode.stretch;
      warp.shift_mm += value * mode.shift_mm;
      continue;
    }
    Eigen::Matrix3Xd& displacement_mm = warp.bumps[mode.grid].displacement_mm;
    displacement_mm(mode.axis, mode.node) += value;
    if (mode.mirror != mode.node) {
      displacement_mm(mode.axis, mode.mirror) += value * mode.mirror_sign * kMirror[mode.axis];
    }
  }
  return warp;
}

}  // namespace skullstation
