#include "reconstruction/phantom/warp_basis.h"

#include <cmath>
#include <numbers>

namespace skullstation {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

const Vector3d kMirror(-1.0, 1.0, 1.0);

double bump_value(const SpaceWarp::Bump& bump, const Vector3d& point) {
  return std::exp(-0.5 * (point - bump.center_mm).squaredNorm() / (bump.width_mm * bump.width_mm));
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
  const auto add = [&](int bump, bool alone, int axis, double mirror_sign) {
    const bool symmetric = mirror_sign > 0.0;
    Mode mode;
    mode.bump = bump;
    mode.alone = alone;
    mode.axis = axis;
    mode.mirror_sign = mirror_sign;
    mode.sd = sd * (symmetric ? 1.0 : asymmetric_share);
    modes_.push_back(mode);
  };
  const Vector3d first = box.min().cwiseQuotient(Vector3d::Constant(layer.spacing_mm));
  const Vector3d last = box.max().cwiseQuotient(Vector3d::Constant(layer.spacing_mm));
  for (int k = static_cast<int>(std::ceil(first.z())); k <= last.z(); ++k) {
    for (int j = static_cast<int>(std::ceil(first.y())); j <= last.y(); ++j) {
      for (int i = 0; i <= last.x(); ++i) {
        const Vector3d center = layer.spacing_mm * Vector3d(i, j, k);
        if (!layer.covers(center)) continue;
        const int bump = static_cast<int>(bumps_.size());
        bumps_.push_back({center, layer.width_mm, Vector3d::Zero()});
        if (i == 0) {
          add(bump, true, 0, -1.0);
          add(bump, true, 1, 1.0);
          add(bump, true, 2, 1.0);
          continue;
        }
        bumps_.push_back({kMirror.cwiseProduct(center), layer.width_mm, Vector3d::Zero()});
        for (int axis = 0; axis < 3; ++axis) {
          add(bump, false, axis, 1.0);
          add(bump, false, axis, -1.0);
        }
      }
    }
  }
}

Eigen::Matrix3Xd WarpBasis::displacements(const Vector3d& point) const {
  std::vector<double> values(bumps_.size());
  for (std::size_t i = 0; i < bumps_.size(); ++i) values[i] = bump_value(bumps_[i], point);
  Eigen::Matrix3Xd displacements(3, size());
  for (int m = 0; m < size(); ++m) {
    const Mode& mode = modes_[m];
    if (mode.bump < 0) {
      displacements.col(m) = mode.sd * (mode.stretch * point + mode.shift_mm);
      continue;
    }
    double value = values[mode.bump];
    if (!mode.alone) value += mode.mirror_sign * kMirror[mode.axis] * values[mode.bump + 1];
    displacements.col(m) = mode.sd * value * Vector3d::Unit(mode.axis);
  }
  return displacements;
}

SpaceWarp WarpBasis::warp(const Eigen::VectorXd& coefficients) const {
  SpaceWarp warp;
  warp.bumps = bumps_;
  for (int m = 0; m < size(); ++m) {
    const Mode& mode = modes_[m];
    const double value = mode.sd * coefficients[m];
    if (mode.bump < 0) {
      warp.stretch += value * mode.stretch;
      warp.shift_mm += value * mode.shift_mm;
      continue;
    }
    warp.bumps[mode.bump].displacement_mm[mode.axis] += value;
    if (!mode.alone) {
      warp.bumps[mode.bump + 1].displacement_mm[mode.axis] +=
          value * mode.mirror_sign * kMirror[mode.axis];
    }
  }
  return warp;
}

}  // namespace skullstation
