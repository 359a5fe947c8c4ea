#include "capture/calibration/camera_calibration.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include "core/adjustment/bundle_solver.h"
#include "core/adjustment/reprojection.h"
#include "core/median.h"
#include "core/root_mean_square.h"
#include "core/session/board_pose.h"
#include "core/units.h"

namespace skullstation {

namespace {

constexpr const char* subject = "camera calibration";

/// A view while the adjustment goes on.
struct ActiveView {
  std::size_t index = 0;  // among the views given
  std::vector<BoardCorner> corners;
  Rigid3 camera_from_board;
};

struct CalibrationResidual {
  Eigen::Vector3d x_board;
  Eigen::Vector2d observed_px;

  template <class T>
  bool operator()(const T* intrinsics, const T* rotation, const T* translation, T* residual) const {
    const Eigen::Matrix<T, 3, 1> x =
        transformed<T>(rotation, translation, x_board.template cast<T>());
    const Eigen::Matrix<T, 2, 1> px = project_opencv<T>(intrinsics, x);
    residual[0] = px.x() - observed_px.x();
    residual[1] = px.y() - observed_px.y();
    return true;
  }
};

using Intrinsics = std::array<double, 8>;

Lens lens_of(const Intrinsics& intrinsics, int width, int height) {
  return Lens::from_params(width, height, LensModel::opencv,
                           {intrinsics.begin(), intrinsics.end()});
}

/// Intrinsics and poses together; `robust` while outliers may still be among the corners.
bool adjust(std::vector<ActiveView>& views, const CharucoBoard& board, bool robust,
            Intrinsics& intrinsics, Eigen::MatrixXd* covariance) {
  ceres::Problem problem;
  std::vector<double*> blocks = {intrinsics.data()};
  problem.AddParameterBlock(intrinsics.data(), 8);
  for (ActiveView& view : views) {
    double* const rotation = view.camera_from_board.rotation.coeffs().data();
    double* const translation = view.camera_from_board.translation.data();
    problem.AddParameterBlock(rotation, 4, new ceres::EigenQuaternionManifold);
    for (const BoardCorner& corner : view.corners) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<CalibrationResidual, 2, 8, 4, 3>(
              new CalibrationResidual{board.corner(corner.id), corner.position_px}),
          robust ? new ceres::HuberLoss(0.5) : nullptr, intrinsics.data(), rotation, translation);
    }
    blocks.push_back(rotation);
    blocks.push_back(translation);
  }
  if (!solve_bundle(problem)) return false;
  if (covariance != nullptr) *covariance = bundle_covariance(problem, blocks, 8);
  return true;
}

/// The focal length, and with it poses, with which a lens without distortion explains the views
/// best, searched over all lengths that cameras have: no start value to be given, no way to fail.
double search_focal_length(std::vector<ActiveView>& views, const CharucoBoard& board, int width,
                           int height) {
  const double side = std::max(width, height);
  double best_focal = side;
  double best_cost = std::numeric_limits<double>::infinity();
  const auto cost_of = [&](double focal, std::vector<Rigid3>& poses) {
    const Lens lens = Lens::from_params(width, height, LensModel::pinhole,
                                        {focal, focal, 0.5 * width, 0.5 * height});
    double cost = 0.0;
    poses.clear();
    for (const ActiveView& view : views) {
      const auto pose = find_board_pose(view.corners, board, lens);
      // A view that contradicts the others must not outweigh them.
      const double limit = 0.02 * side;
      cost += pose ? std::min(pose->rms_px, limit) : limit;
      poses.push_back(pose ? pose->camera_from_board : Rigid3{});
      if (!pose) poses.back().translation.z() = focal;
    }
    return cost;
  };
  std::vector<Rigid3> poses;
  constexpr int steps = 24;
  for (int step = 0; step < steps; ++step) {
    const double focal = 0.4 * side * std::pow(30.0, step / (steps - 1.0));
    const double cost = cost_of(focal, poses);
    if (cost < best_cost) {
      best_cost = cost;
      best_focal = focal;
    }
  }
  cost_of(best_focal, poses);
  for (std::size_t i = 0; i < views.size(); ++i) views[i].camera_from_board = poses[i];
  return best_focal;
}

/// The first, crude lens may have chosen the wrong one of the two poses that a plane allows: looks
/// again at the views that fit worse than most.
void choose_better_poses(std::vector<ActiveView>& views, const CharucoBoard& board,
                         const Lens& lens) {
  std::vector<double> rms_px;
  rms_px.reserve(views.size());
  for (const ActiveView& view : views) {
    rms_px.push_back(
        root_mean_square(corner_errors_px(view.corners, board, lens, view.camera_from_board)));
  }
  const double typical = median(rms_px);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (rms_px[i] < 1.5 * typical) continue;
    const auto other = find_board_pose(views[i].corners, board, lens);
    if (other && other->rms_px < rms_px[i]) views[i].camera_from_board = other->camera_from_board;
  }
}

/// Takes out what contradicts the rest: single corners, and views most of whose corners do.
/// Returns whether there was any.
bool remove_outliers(std::vector<ActiveView>& views, const CharucoBoard& board, const Lens& lens,
                     std::vector<CalibrationViewReport>& reports) {
  // Sub-pixel corners scatter by some hundredths of a pixel; what is below this is no outlier
  // however exact the others are.
  constexpr double always_good_px = 0.15;
  std::vector<double> view_medians;
  std::vector<double> all_errors;
  for (const ActiveView& view : views) {
    const std::vector<double> errors =
        corner_errors_px(view.corners, board, lens, view.camera_from_board);
    view_medians.push_back(median(errors));
    all_errors.insert(all_errors.end(), errors.begin(), errors.end());
  }
  // A Rayleigh distribution's median is 1.18 sd; 5 sd of each coordinate are never reached.
  const double typical = median(all_errors);
  const double view_limit = std::max(always_good_px, 3.0 * typical);
  const double corner_limit = std::max(2.0 * always_good_px, 5.0 / 1.18 * typical);
  bool removed = false;
  std::vector<ActiveView> kept;
  for (std::size_t i = 0; i < views.size(); ++i) {
    ActiveView& view = views[i];
    if (view_medians[i] > view_limit) {
      reports[view.index].left_out = fmt::format(
          "contradicts the other views (median error {:.2f} px, theirs {:.2f} px): "
          "blurred, moved, or the board was bent",
          view_medians[i], typical);
      removed = true;
      continue;
    }
    const std::vector<double> errors =
        corner_errors_px(view.corners, board, lens, view.camera_from_board);
    std::vector<BoardCorner> good;
    for (std::size_t c = 0; c < errors.size(); ++c) {
      if (errors[c] <= corner_limit) good.push_back(view.corners[c]);
    }
    if (good.size() < view.corners.size()) removed = true;
    if (10 * good.size() < 7 * view.corners.size()) {
      reports[view.index].left_out = "too many of its corners contradict the other views";
      continue;
    }
    view.corners = std::move(good);
    kept.push_back(std::move(view));
  }
  views = std::move(kept);
  return removed;
}

/// Direction and size of the board's tilt against the image plane: its normal's x and y in the
/// camera's frame.
Eigen::Vector2d tilt_of(const Rigid3& camera_from_board) {
  const Eigen::Vector3d normal = camera_from_board.rotation * Eigen::Vector3d::UnitZ();
  return normal.head<2>();
}

Result<void> check_tilts(const std::vector<ActiveView>& views,
                         const CameraCalibrationOptions& options) {
  std::vector<double> azimuths_deg;
  for (const ActiveView& view : views) {
    const Eigen::Vector2d tilt = tilt_of(view.camera_from_board);
    if (tilt.norm() >= std::sin(radians(options.tilted_from_deg))) {
      azimuths_deg.push_back(degrees(std::atan2(tilt.y(), tilt.x())));
    }
  }
  if (std::cmp_less(azimuths_deg.size(), options.min_tilted_views)) {
    return fail(ErrorKind::no_result, subject,
                fmt::format("only {} of {} views look at the board aslant (by {:.0f} deg or more); "
                            "{} are needed, since frontal views don't show the focal length",
                            azimuths_deg.size(), views.size(), options.tilted_from_deg,
                            options.min_tilted_views),
                "tilt the board by 20 to 45 deg: left, right, forwards and backwards");
  }
  double spread_deg = 0.0;
  for (const double a : azimuths_deg) {
    for (const double b : azimuths_deg) {
      const double turn = std::abs(turn_deg(a, b));  // tilting there or back is the same axis
      spread_deg = std::max(spread_deg, std::min(turn, 180.0 - turn));
    }
  }
  if (spread_deg < options.min_tilt_spread_deg) {
    return fail(ErrorKind::no_result, subject,
                fmt::format("all views tilt the board about nearly the same axis (within {:.0f} "
                            "deg)",
                            spread_deg),
                "tilt the board left and right as well as forwards and backwards");
  }
  return {};
}

double coverage_of(const std::vector<ActiveView>& views, int width, int height) {
  constexpr int columns = 8;
  constexpr int rows = 6;
  std::set<int> cells;
  for (const ActiveView& view : views) {
    for (const BoardCorner& corner : view.corners) {
      const int column = static_cast<int>(corner.position_px.x() * columns / width);
      const int row = static_cast<int>(corner.position_px.y() * rows / height);
      cells.insert(std::clamp(row, 0, rows - 1) * columns + std::clamp(column, 0, columns - 1));
    }
  }
  return static_cast<double>(cells.size()) / (columns * rows);
}

Result<void> check_input(const std::vector<CalibrationView>& views, const CharucoBoard& board,
                         int width, int height, const CameraCalibrationOptions& options) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (const auto valid = board.validate(); !valid) return forward(valid);
  if (width <= 0 || height <= 0) {
    return fail(ErrorKind::bad_input, subject, fmt::format("images of {} x {} px", width, height));
  }
  for (const CalibrationView& view : views) {
    std::set<int> ids;
    for (const BoardCorner& corner : view.corners) {
      if (corner.id < 0 || corner.id >= board.corner_count() || !ids.insert(corner.id).second) {
        return fail(ErrorKind::bad_input, view.name,
                    fmt::format("corner {} is not the board's or there twice", corner.id));
      }
    }
  }
  return {};
}

std::string left_out_list(const std::vector<CalibrationViewReport>& reports) {
  std::string list;
  for (const CalibrationViewReport& report : reports) {
    if (report.left_out.empty()) continue;
    list += fmt::format("{}{}: {}", list.empty() ? "" : "; ", report.name, report.left_out);
  }
  return list;
}

Result<void> check_view_count(std::size_t usable, const std::vector<CalibrationViewReport>& reports,
                              const CameraCalibrationOptions& options) {
  if (std::cmp_greater_equal(usable, options.min_views)) return {};
  const std::string list = left_out_list(reports);
  return fail(ErrorKind::no_result, subject,
              fmt::format("{} of {} views can be used, {} are needed{}{}", usable, reports.size(),
                          options.min_views, list.empty() ? "" : "; left out: ", list),
              "take more pictures, sharp and with most of the board inside the frame");
}

}  // namespace

Result<void> CameraCalibrationOptions::validate() const {
  // Fewer views or corners would leave unknowns without an equation.
  if (min_views < 3 || min_corners_per_view < 6 || min_tilted_views < 2 ||
      !(tilted_from_deg > 0.0) || !(tilted_from_deg < 90.0) || !(min_tilt_spread_deg >= 0.0) ||
      !(min_tilt_spread_deg <= 90.0) || !(min_coverage >= 0.0) || !(min_coverage <= 1.0) ||
      !(max_focal_error_percent > 0.0) || !(max_rms_px > 0.0)) {
    return fail(ErrorKind::bad_input, "camera calibration options", "are out of their range");
  }
  return {};
}

Result<CameraCalibrationReport> calibrate_camera(const std::vector<CalibrationView>& views,
                                                 const CharucoBoard& board, int width, int height,
                                                 const CameraCalibrationOptions& options) {
  if (const auto valid = check_input(views, board, width, height, options); !valid) {
    return forward(valid);
  }
  CameraCalibrationReport report;
  std::vector<ActiveView> active;
  for (std::size_t i = 0; i < views.size(); ++i) {
    CalibrationViewReport& about = report.views.emplace_back();
    about.name = views[i].name;
    about.corners = static_cast<int>(views[i].corners.size());
    if (about.corners < options.min_corners_per_view) {
      about.left_out =
          about.corners == 0
              ? std::string("the board was not found in it")
              : fmt::format("only {} corners of the board were found in it", about.corners);
    } else {
      active.push_back({i, views[i].corners, {}});
    }
  }
  if (const auto enough = check_view_count(active.size(), report.views, options); !enough) {
    return forward(enough);
  }

  const double focal = search_focal_length(active, board, width, height);
  Intrinsics intrinsics = {focal, focal, 0.5 * width, 0.5 * height, 0.0, 0.0, 0.0, 0.0};
  constexpr int max_rounds = 10;
  for (int round = 0; round < max_rounds; ++round) {
    if (!adjust(active, board, true, intrinsics, nullptr)) {
      return fail(ErrorKind::no_result, subject, "the views don't lead to any intrinsics",
                  "take them again, more varied");
    }
    const Lens lens = lens_of(intrinsics, width, height);
    choose_better_poses(active, board, lens);
    if (!remove_outliers(active, board, lens, report.views)) break;
    if (const auto enough = check_view_count(active.size(), report.views, options); !enough) {
      return forward(enough);
    }
  }
  Eigen::MatrixXd covariance;
  if (!adjust(active, board, false, intrinsics, &covariance)) {
    return fail(ErrorKind::no_result, subject, "the views don't lead to any intrinsics",
                "take them again, more varied");
  }

  CameraCalibration& calibration = report.calibration;
  calibration.lens = lens_of(intrinsics, width, height);
  calibration.views = static_cast<int>(active.size());
  double squared_error = 0.0;
  for (const ActiveView& view : active) {
    CalibrationViewReport& about = report.views[view.index];
    about.rms_px = root_mean_square(
        corner_errors_px(view.corners, board, calibration.lens, view.camera_from_board));
    about.camera_from_board = view.camera_from_board;
    about.tilt_deg = degrees(std::asin(std::min(1.0, tilt_of(view.camera_from_board).norm())));
    squared_error += about.rms_px * about.rms_px * static_cast<double>(view.corners.size());
    calibration.corners += static_cast<int>(view.corners.size());
  }
  calibration.rms_px = std::sqrt(squared_error / calibration.corners);
  report.coverage = coverage_of(active, width, height);

  if (!(calibration.rms_px <= options.max_rms_px)) {
    return fail(ErrorKind::no_result, subject,
                fmt::format("the corners lie {:.2f} px (RMS) off where a flat board would have "
                            "them; {:.2f} px are allowed",
                            calibration.rms_px, options.max_rms_px),
                "glue the board to something flat and check that its description is right");
  }
  if (const auto tilted = check_tilts(active, options); !tilted) return forward(tilted);
  if (report.coverage < options.min_coverage) {
    return fail(ErrorKind::no_result, subject,
                fmt::format("the board was seen in only {:.0f} % of the image; {:.0f} % are needed "
                            "to know the lens's distortion",
                            100.0 * report.coverage, 100.0 * options.min_coverage),
                "hold the board into the corners and edges of the picture too");
  }
  if (covariance.size() == 0) {
    return fail(ErrorKind::no_result, subject, "the views don't determine the intrinsics",
                "take more pictures of the board in other positions, aslant in all directions");
  }
  const double degrees_of_freedom = 2.0 * calibration.corners - 8.0 - 6.0 * calibration.views;
  const double variance = squared_error / degrees_of_freedom;
  for (int i = 0; i < 8; ++i) {
    calibration.standard_errors.push_back(std::sqrt(variance * covariance(i, i)));
  }
  const double focal_error_percent =
      100.0 * std::max(calibration.standard_errors[0] / calibration.lens.fx,
                       calibration.standard_errors[1] / calibration.lens.fy);
  if (!(focal_error_percent <= options.max_focal_error_percent)) {
    return fail(ErrorKind::no_result, subject,
                fmt::format("the focal length is known to {:.2f} % only; {:.2f} % are needed",
                            focal_error_percent, options.max_focal_error_percent),
                "take more pictures, closer and more aslant (20 to 45 deg)");
  }
  return report;
}

}  // namespace skullstation
