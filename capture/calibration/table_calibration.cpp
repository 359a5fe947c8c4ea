#include "capture/calibration/table_calibration.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "capture/calibration/table_bundle.h"
#include "capture/calibration/turn_regression.h"
#include "core/linear_algebra.h"
#include "core/session/board_pose.h"
#include "core/units.h"

namespace skullstation {

namespace {

constexpr const char* subject = "table calibration";

tl::unexpected<Error> refuse(std::string where, std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, std::move(where), std::move(what), std::move(advice));
}

/// The input in the bundle's terms.
struct Prepared {
  std::vector<TableObservation> observations;
  std::vector<std::string> names;  // of the views, per observation
  std::vector<Lens> lenses;
  std::vector<int> stops;  // as the caller numbers them
  std::vector<double> commanded_deg;
};

Result<void> check_view(const TableView& view, const CharucoBoard& board,
                        const TableCalibrationOptions& options) {
  std::set<int> ids;
  for (const BoardCorner& corner : view.corners) {
    if (corner.id < 0 || corner.id >= board.corner_count() || !ids.insert(corner.id).second) {
      return refuse(view.name,
                    fmt::format("corner {} is not the board's or there twice", corner.id));
    }
  }
  if (std::cmp_less(view.corners.size(), options.min_corners_per_view)) {
    return refuse(view.name,
                  view.corners.empty()
                      ? std::string("the board is not visible")
                      : fmt::format("only {} corners of the board are visible, {} are needed",
                                    view.corners.size(), options.min_corners_per_view),
                  "take the specimen off the table, lay the board flat in the middle, and check "
                  "light, focus and the board's description");
  }
  return {};
}

Result<Prepared> prepare(const std::vector<TableView>& views,
                         const std::vector<TableCamera>& cameras, const CharucoBoard& board,
                         const TableCalibrationOptions& options) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (const auto valid = board.validate(); !valid) return forward(valid);
  Prepared prepared;
  std::map<std::string, int> camera_index;
  for (const TableCamera& camera : cameras) {
    if (!(camera.lens.fx > 0.0) || !(camera.lens.fy > 0.0)) {
      return refuse(fmt::format("camera {}", camera.id), "has no intrinsics",
                    "calibrate the camera first");
    }
    const int index = static_cast<int>(prepared.lenses.size());
    if (!camera_index.emplace(camera.id, index).second) {
      return refuse(fmt::format("camera {}", camera.id), "is listed twice");
    }
    prepared.lenses.push_back(camera.lens);
  }
  std::map<int, double> commanded;
  std::set<std::pair<int, int>> seen;
  std::vector<char> sees(cameras.size());
  for (const TableView& view : views) {
    const auto camera = camera_index.find(view.camera);
    if (camera == camera_index.end()) {
      return refuse(view.name, fmt::format("camera \"{}\" is not known", view.camera));
    }
    const auto [stop, is_new] = commanded.emplace(view.stop, view.commanded_deg);
    if (!std::isfinite(view.commanded_deg) || (!is_new && stop->second != view.commanded_deg)) {
      return refuse(view.name, fmt::format("its angle {} deg is not that of the stop's other views",
                                           view.commanded_deg));
    }
    if (!seen.emplace(view.stop, camera->second).second) {
      return refuse(view.name, "is the camera's second view of the same stop");
    }
    if (const auto good = check_view(view, board, options); !good) return forward(good);
    sees[static_cast<std::size_t>(camera->second)] = 1;
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (sees[i] == 0) return refuse(fmt::format("camera {}", cameras[i].id), "has no views");
  }
  for (const auto& [stop, angle_deg] : commanded) {
    prepared.stops.push_back(stop);
    prepared.commanded_deg.push_back(angle_deg);
  }
  for (const TableView& view : views) {
    const auto stop = std::lower_bound(prepared.stops.begin(), prepared.stops.end(), view.stop);
    prepared.observations.push_back({camera_index.at(view.camera),
                                     static_cast<int>(stop - prepared.stops.begin()),
                                     view.corners});
    prepared.names.push_back(view.name);
  }
  return prepared;
}

/// Enough stops, spread enough, near enough to each other?
Result<void> check_angles(const std::vector<double>& commanded_deg,
                          const TableCalibrationOptions& options) {
  const std::string advice = "calibrate with 12 or more stops over the full turn";
  if (std::cmp_less(commanded_deg.size(), options.min_stops)) {
    return refuse(subject,
                  fmt::format("only {} stops of the table; {} are needed", commanded_deg.size(),
                              options.min_stops),
                  advice);
  }
  double at_deg = 0.0;
  double low_deg = 0.0;
  double high_deg = 0.0;
  for (std::size_t i = 1; i < commanded_deg.size(); ++i) {
    const double step_deg = turn_deg(commanded_deg[i - 1], commanded_deg[i]);
    if (std::abs(step_deg) > options.max_step_deg) {
      return refuse(subject,
                    fmt::format("from {} to {} deg is farther than {} deg, beyond which the "
                                "direction of turning can't be told",
                                commanded_deg[i - 1], commanded_deg[i], options.max_step_deg),
                    advice);
    }
    at_deg += step_deg;
    low_deg = std::min(low_deg, at_deg);
    high_deg = std::max(high_deg, at_deg);
  }
  if (high_deg - low_deg < options.min_span_deg) {
    return refuse(subject,
                  fmt::format("the stops span {:.0f} deg only; {:.0f} deg are needed",
                              high_deg - low_deg, options.min_span_deg),
                  advice);
  }
  return {};
}

std::vector<double> corner_errors(const TableState& state, const std::vector<Lens>& lenses,
                                  const CharucoBoard& board, const TableObservation& seen) {
  std::vector<double> errors;
  for (const BoardCorner& corner : seen.corners) {
    const Eigen::Vector2d px = project_corner(state, lenses, seen, board.corner(corner.id));
    errors.push_back((px - corner.position_px).norm());
  }
  return errors;
}

/// Single corners that lie far off all others' error; a view keeps at least three quarters of its
/// corners, since a whole view that departs tells of the table, not of the corners.
void remove_outlying_corners(Prepared& prepared, const CharucoBoard& board,
                             const TableState& state) {
  for (TableObservation& seen : prepared.observations) {
    const std::vector<double> errors = corner_errors(state, prepared.lenses, board, seen);
    std::vector<double> sorted = errors;
    std::sort(sorted.begin(), sorted.end());
    // Five standard deviations; a Rayleigh distribution's median is 1.18 of them.
    const double limit =
        std::max({0.3, 5.0 / 1.18 * sorted[sorted.size() / 2], sorted[sorted.size() * 3 / 4]});
    std::vector<BoardCorner> kept;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (errors[i] <= limit) kept.push_back(seen.corners[i]);
    }
    seen.corners = std::move(kept);
  }
}

/// Greatest displacement of the board's outer corners against a pure rotation, less what the
/// corners' noise alone would make it appear (in squares).
double wobble_mm(const StopDeparture& departure, double pixel_variance, const CharucoBoard& board,
                 const TableState& state, double angle_rad) {
  const Rigid3 station_from_board =
      rotation_about_z(degrees(angle_rad)) * state.axis.table_from_board();
  const Eigen::Vector3d turn = departure.motion.head<3>();
  const Eigen::Vector3d shift = departure.motion.tail<3>();
  double greatest = 0.0;
  for (const double side_x : {-0.5, 0.5}) {
    for (const double side_y : {-0.5, 0.5}) {
      const Eigen::Vector3d rim =
          station_from_board *
          Eigen::Vector3d(side_x * board.width_mm(), side_y * board.height_mm(), 0.0);
      // For small turns: displacement = turn x rim + shift.
      Eigen::Matrix<double, 3, 6> by_motion;
      by_motion << 0.0, rim.z(), -rim.y(), 1.0, 0.0, 0.0,  //
          -rim.z(), 0.0, rim.x(), 0.0, 1.0, 0.0,           //
          rim.y(), -rim.x(), 0.0, 0.0, 0.0, 1.0;
      const double noise =
          pixel_variance * (by_motion * departure.covariance * by_motion.transpose()).trace();
      const double squared = (turn.cross(rim) + shift).squaredNorm();
      greatest = std::max(greatest, squared - noise);
    }
  }
  return std::sqrt(greatest);
}

}  // namespace

Result<void> TableCalibrationOptions::validate() const {
  if (min_stops < 3 || !(min_span_deg > 0.0) || !(min_span_deg <= 360.0) || !(max_step_deg > 0.0) ||
      !(max_step_deg < 180.0) || min_corners_per_view < 6 || !(max_rms_px > 0.0)) {
    return refuse("table calibration options", "are out of their range");
  }
  return {};
}

Result<TableCalibrationReport> calibrate_table(const std::vector<TableView>& views,
                                               const std::vector<TableCamera>& cameras,
                                               const CharucoBoard& board,
                                               const TableCalibrationOptions& options) {
  Result<Prepared> prepared = prepare(views, cameras, board, options);
  if (!prepared) return forward(prepared);
  if (const auto good = check_angles(prepared->commanded_deg, options); !good) {
    return forward(good);
  }
  const std::vector<Lens>& lenses = prepared->lenses;
  const auto stop_count = prepared->stops.size();

  std::vector<Rigid3> camera_from_board;
  for (std::size_t i = 0; i < prepared->observations.size(); ++i) {
    const TableObservation& seen = prepared->observations[i];
    const auto pose =
        find_board_pose(seen.corners, board, lenses[static_cast<std::size_t>(seen.camera)]);
    if (!pose) {
      return fail(ErrorKind::no_result, prepared->names[i],
                  "the corners seen don't tell where the board is",
                  "make more of the board visible");
    }
    camera_from_board.push_back(pose->camera_from_board);
  }
  constexpr double min_turn_deg = 5.0;
  auto state =
      first_table_state(prepared->observations, camera_from_board, static_cast<int>(lenses.size()),
                        static_cast<int>(stop_count), min_turn_deg);
  if (!state) {
    return fail(ErrorKind::no_result, subject,
                "the board does not turn with the table, or a camera shares no stop with the "
                "others",
                "check that the motor turns the platter and that the board lies on it, face up");
  }
  auto adjusted = adjust_table(prepared->observations, lenses, board, true, *state);
  if (adjusted) {
    remove_outlying_corners(*prepared, board, *state);
    adjusted = adjust_table(prepared->observations, lenses, board, false, *state);
  }
  if (!adjusted) {
    return fail(ErrorKind::no_result, subject, "the views don't determine the table's axis",
                "calibrate with more stops over the full turn");
  }

  TableCalibrationReport report;
  TableCalibration& calibration = report.calibration;
  calibration.board = board;
  calibration.table_from_board = state->axis.table_from_board();
  std::vector<double> measured_deg;
  for (const double angle_rad : state->angles_rad) measured_deg.push_back(degrees(angle_rad));
  const TurnRegression turns = regress_turns(prepared->commanded_deg, measured_deg);
  calibration.reversed = turns.slope < 0.0;
  calibration.turn_ratio = std::abs(turns.slope);
  calibration.turn_ratio_error = turns.slope_error;
  calibration.angle_rms_deg = turns.rms_deg;

  std::vector<double> squared_error(lenses.size());
  std::vector<int> corners(lenses.size());
  double all_squared_error = 0.0;
  int all_corners = 0;
  for (const TableObservation& seen : prepared->observations) {
    const auto camera = static_cast<std::size_t>(seen.camera);
    for (const double error : corner_errors(*state, lenses, board, seen)) {
      squared_error[camera] += error * error;
      all_squared_error += error * error;
    }
    corners[camera] += static_cast<int>(seen.corners.size());
    all_corners += static_cast<int>(seen.corners.size());
  }
  report.rms_px = std::sqrt(all_squared_error / all_corners);
  if (!(report.rms_px <= options.max_rms_px)) {
    return fail(ErrorKind::no_result, subject,
                fmt::format("the corners lie {:.2f} px (RMS) off where a turning board would have "
                            "them; {:.2f} px are allowed",
                            report.rms_px, options.max_rms_px),
                "check that the board lies still and flat, that its description is right, and that "
                "the cameras' calibrations are theirs");
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    // The table's zero is where it was commanded to be at 0, by all stops together.
    calibration.cameras.push_back(
        {cameras[i].id, state->camera_from_station[i] * rotation_about_z(turns.offset_deg),
         std::sqrt(squared_error[i] / corners[i])});
  }

  const double freedom = 2.0 * all_corners - 4.0 - 6.0 * static_cast<double>(lenses.size()) -
                         (static_cast<double>(stop_count) - 1.0);
  const double variance = all_squared_error / freedom;
  // The larger half axis of each error ellipse.
  const auto largest_error = [&](const Eigen::Matrix2d& covariance) {
    return std::sqrt(variance * symmetric_spectrum(covariance).values[1]);
  };
  calibration.axis_error_mm = largest_error(adjusted->axis.topLeftCorner<2, 2>());
  // (x, y, 1) turns by the radians that x, y change, for an axis near the board's normal.
  calibration.axis_error_deg = degrees(largest_error(adjusted->axis.bottomRightCorner<2, 2>()));

  double departed_squares = 0.0;
  int departed_freedom = 0;
  std::vector<std::optional<StopDeparture>> departures;
  for (std::size_t stop = 0; stop < stop_count; ++stop) {
    departures.push_back(
        departure_of_stop(prepared->observations, lenses, board, *state, static_cast<int>(stop)));
    if (!departures.back()) {
      return fail(
          ErrorKind::no_result, fmt::format("the stop at {} deg", prepared->commanded_deg[stop]),
          "the corners seen don't tell where the board is", "make more of the board visible");
    }
    departed_squares += departures.back()->squared_error_px2;
    departed_freedom += 2 * departures.back()->corners - 6;
  }
  const double pixel_variance = departed_squares / departed_freedom;
  for (std::size_t stop = 0; stop < stop_count; ++stop) {
    TableStopReport& about = report.stops.emplace_back();
    about.stop = prepared->stops[stop];
    about.commanded_deg = turns.commanded_deg[stop];
    about.measured_deg = turns.measured_deg[stop];
    about.residual_deg = turns.residual_deg[stop];
    about.wobble_mm =
        wobble_mm(*departures[stop], pixel_variance, board, *state, state->angles_rad[stop]);
    calibration.wobble_mm = std::max(calibration.wobble_mm, about.wobble_mm);
  }
  report.verdicts = motion_verdicts(calibration);
  return report;
}

}  // namespace skullstation
