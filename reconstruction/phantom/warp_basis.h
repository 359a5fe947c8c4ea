#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "reconstruction/phantom/space_warp.h"

namespace skullstation {

/// One layer of a warp basis: Gaussian bumps of one width on a cubic grid.
struct BumpLayer {
  double spacing_mm = 40.0;
  double width_mm = 40.0;
  /// Standard deviation of the displacement that the layer's bumps make together.
  double sd_mm = 1.0;
  /// Where the layer's centres lie (asked for points with x >= 0).
  std::function<bool(const Eigen::Vector3d& center)> covers;
};

struct WarpBasisOptions {
  std::vector<BumpLayer> layers;
  double stretch_sd = 0.05;        ///< of the affine part's symmetric entries
  double shift_sd_mm = 5.0;        ///< of its shift within the midsagittal plane
  double asymmetric_share = 0.15;  ///< SD of a mode against mirror symmetry to that of one with it
};

/// The displacement fields a person's warp is mixed from, each with a coefficient that is standard
/// normal before anything is known of the person: a Gaussian process on space in its weight-space
/// form (Rasmussen & Williams 2006, section 2.1). Fields come as pairs, one symmetric in the
/// midsagittal plane x = 0 and one antisymmetric.
class WarpBasis {
 public:
  WarpBasis(const Eigen::AlignedBox3d& box, const WarpBasisOptions& options);

  static constexpr int kAffineModes = 12;  ///< the first coefficients are those of the affine part

  int size() const { return static_cast<int>(modes_.size()); }
  /// 3 x size: displacement of the point for each coefficient of one.
  Eigen::Matrix3Xd displacements(const Eigen::Vector3d& point) const;
  SpaceWarp warp(const Eigen::VectorXd& coefficients) const;

 private:
  struct Mode {
    int grid = -1;            ///< of bumps_, or -1: affine
    Eigen::Index node = 0;    ///< in that grid
    Eigen::Index mirror = 0;  ///< the node's mirror image; itself in the midsagittal plane
    double mirror_sign = 1.0;
    double sd = 1.0;
    int axis = 0;
    Eigen::Matrix3d stretch = Eigen::Matrix3d::Zero();
    Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
  };
  void add_affine(const WarpBasisOptions& options);
  void add_layer(const Eigen::AlignedBox3d& box, const BumpLayer& layer, double asymmetric_share);

  std::vector<BumpGrid> bumps_;  ///< without displacement
  std::vector<Mode> modes_;
};

}  // namespace skullstation
