#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/adjustment/table_axis.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// Intrinsics under adjustment: fx fy cx cy k1 k2 p1 p2, drawn to what is known about them.
struct BundleLens {
  Lens lens;                   ///< start value and result
  Lens known;                  ///< what the calibration says ...
  std::array<double, 8> sd{};  ///< ... and how far it may be off; 0: exact
  double aspect_sd = 5e-4;     ///< of fx / fy, which no change of focus alters
};

/// Where a view shows one of `BundleProblem::points`.
struct BundleSight {
  int point = 0;
  Eigen::Vector2d position_px;
};

/// One view of the board, of points of the specimen, or of both.
struct BundleView {
  int lens = 0;
  int ring = -1;           ///< index of its BundleRing; -1: nothing is known about its place
  double angle_rad = 0.0;  ///< of the table: start value and result
  double commanded_rad = 0.0;
  std::vector<BoardCorner> corners;
  std::vector<BundleSight> sights;
  Rigid3 camera_from_board;  ///< start value and result
};

/// One camera in one pass: it stands still while the table turns.
struct BundleRing {
  int axis = 0;
  Rigid3 camera_from_station;  ///< start value and result
};

/// How well the table does what it is told: the structure of a ring is believed to that degree.
struct TableTrust {
  double departure_mm = 0.0;  ///< of points at `reach_mm` from a pure rotation
  double angle_sd_deg = 0.0;  ///< of the commanded angles
  double reach_mm = 120.0;
};

struct BundleProblem {
  std::vector<BundleLens> lenses;
  std::vector<BundleView> views;
  std::vector<BundleRing> rings;
  std::vector<TableAxis> axes;          ///< one a pass
  std::vector<Eigen::Vector3d> points;  ///< of the specimen: start values and results
  double corner_sd_px = 0.1;            ///< of one coordinate
  double sight_sd_px = 0.5;             ///< of one coordinate
  double huber_sds = 3.0;  ///< errors beyond so many standard deviations count linearly
};

/// Covariance of all unknowns that are free, from the normal equations.
struct BundleCovariance {
  /// Of each view's pose as a motion in the camera's frame: rotation vector [rad], then shift [mm].
  std::vector<Eigen::Matrix<double, 6, 6>> views;
  std::vector<std::array<double, 8>> lens_sd;
  /// Relative standard error of the mean distance of all cameras from the board's middle.
  double scale_sd = 0.0;
};

/// Adjusts lenses and views to the board's corners (Triggs et al. 2000). With `trust`, rings and
/// axes too: each view is drawn to where its ring has it. The same on any machine and for any
/// number of threads: one is used. False if no usable solution was found.
bool adjust_views(BundleProblem& problem, const CharucoBoard& board,
                  const std::optional<TableTrust>& trust);

/// Adjusts views and the specimen's points to where the views show them, lenses held, each view
/// drawn to where its ring has it; rings and axes too. The same on any machine and for any number
/// of threads: one is used. False if no usable solution was found.
bool adjust_views_by_points(BundleProblem& problem, const TableTrust& trust);

/// Adjusts rings, axes and angles to the views' poses as they are, with a robust loss of
/// `loss_mm`. False if no usable solution was found.
bool adjust_rings(BundleProblem& problem, double reach_mm, double loss_mm);

/// Nothing where some unknown is not determined.
std::optional<BundleCovariance> covariance_of(BundleProblem& problem, const CharucoBoard& board,
                                              const std::optional<TableTrust>& trust);

/// Of each view's pose, as in BundleCovariance, from the points' sights alone, the points unknown:
/// of the seven unknowns that no photograph tells (place, direction and unit of the whole) nothing
/// is counted (free network; Triggs et al. 2000, section 9). Empty where more is not determined.
std::vector<Eigen::Matrix<double, 6, 6>> covariance_by_points(BundleProblem& problem,
                                                              double reach_mm);

/// The points whose displacement measures a departure from a pure rotation (board frame).
std::array<Eigen::Vector3d, 4> reach_points(double reach_mm);

/// Root mean square displacement of those points between a view's own pose and its ring's [mm].
double ring_departure_mm(const BundleProblem& problem, const BundleView& view, double reach_mm);

}  // namespace skullstation
