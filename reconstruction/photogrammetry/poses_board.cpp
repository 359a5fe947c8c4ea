#include "reconstruction/photogrammetry/poses_board.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/median.h"
#include "core/parallel.h"
#include "core/root_mean_square.h"
#include "core/session/board_pose.h"
#include "core/units.h"
#include "reconstruction/photogrammetry/bundle_adjustment.h"
#include "reconstruction/photogrammetry/poses_rings.h"
#include "reconstruction/photogrammetry/scale_check.h"

namespace skullstation {

namespace {

constexpr const char* subject = "poses from the board";

/// A Rayleigh distribution's median over the standard deviation of one coordinate.
constexpr double rayleigh_median = 1.1774;

/// The views still in use, as the bundle holds them, and where they came from.
struct Work {
  BundleProblem bundle;
  std::vector<std::size_t> observation;  ///< of each of the bundle's views
};

void drop_view(Work& work, std::size_t view, std::string reason, PoseResult& result) {
  result.views[work.observation[view]].dropped = std::move(reason);
  work.bundle.views.erase(work.bundle.views.begin() + static_cast<std::ptrdiff_t>(view));
  work.observation.erase(work.observation.begin() + static_cast<std::ptrdiff_t>(view));
}

std::string dropped_list(const PoseResult& result) {
  std::string list;
  for (const ViewPose& view : result.views) {
    if (!view.used()) list += fmt::format("\n  {}: {}", view.name, view.dropped);
  }
  return list;
}

Result<void> check_count(const Work& work, const PoseResult& result, const CharucoBoard& board,
                         const BoardPoseOptions& options) {
  if (std::cmp_greater_equal(work.observation.size(), options.least_views)) return {};
  const bool nothing_seen =
      std::ranges::all_of(result.views, [](const ViewPose& view) { return view.corners == 0; });
  if (nothing_seen) {
    return fail(
        ErrorKind::no_result, subject,
        fmt::format("none of the {} views shows the board that session.json describes "
                    "({} x {} squares, {})",
                    result.views.size(), board.squares_x, board.squares_y, board.dictionary),
        "look at the pictures: are they black or blurred, is it another board?");
  }
  return fail(ErrorKind::no_result, subject,
              fmt::format("{} of {} views can be used, {} are needed:{}", work.observation.size(),
                          result.views.size(), options.least_views, dropped_list(result)),
              "take more views that show the board beside the specimen");
}

/// What a lens may be off by: its calibration is some time old.
std::array<double, 8> calibrated_sd(const Lens& lens, const BoardPoseOptions& options) {
  const double focal = 0.01 * options.focal_sd_percent * lens.fx;
  const double centre = 0.01 * options.centre_sd_percent * lens.width;
  return {focal,
          focal,
          centre,
          centre,
          options.radial_sd,
          options.radial_sd,
          options.tangential_sd,
          options.tangential_sd};
}

/// What any camera's lens may be, about the middle of the range.
std::array<double, 8> unknown_sd(const Lens& lens) {
  return {lens.fx, lens.fx, 0.01 * lens.width, 0.01 * lens.width, 0.1, 0.1, 1e-3, 1e-3};
}

/// The focal length with which a lens without distortion explains the camera's views best, among
/// all that cameras have.
Lens search_lens(const std::vector<PoseObservation>& views, int camera, int width, int height,
                 const CharucoBoard& board, int least_corners) {
  constexpr int steps = 24;
  constexpr std::size_t most_views = 8;
  std::vector<const PoseObservation*> chosen;
  for (const PoseObservation& view : views) {
    if (view.camera == camera && std::cmp_greater_equal(view.corners.size(), least_corners)) {
      chosen.push_back(&view);
    }
  }
  const std::size_t stride = std::max<std::size_t>(1, chosen.size() / most_views);
  const double side = std::max(width, height);
  Lens best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int step = 0; step < steps; ++step) {
    const double focal = 0.5 * side * std::pow(12.0, step / (steps - 1.0));
    const Lens lens = Lens::from_params(width, height, LensModel::pinhole,
                                        {focal, focal, 0.5 * width, 0.5 * height});
    const double limit_px = 0.02 * side;
    double cost = 0.0;
    for (std::size_t i = 0; i < chosen.size(); i += stride) {
      const auto found = find_board_pose(chosen[i]->corners, board, lens);
      cost += found ? std::min(found->rms_px, limit_px) : limit_px;
    }
    if (cost < best_cost) {
      best_cost = cost;
      best = lens;
    }
  }
  return best;
}

Work begin(const std::vector<PoseObservation>& views, const std::vector<PoseCamera>& cameras,
           const CharucoBoard& board, const BoardPoseOptions& options, PoseResult& result) {
  Work work;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const PoseCamera& camera = cameras[c];
    BundleLens& lens = work.bundle.lenses.emplace_back();
    if (camera.lens) {
      lens.lens = *camera.lens;
      if (camera.refine) lens.sd = calibrated_sd(lens.lens, options);
    } else {
      lens.lens = search_lens(views, static_cast<int>(c), camera.width, camera.height, board,
                              options.least_corners);
      lens.sd = unknown_sd(lens.lens);
    }
    if (camera.model == LensModel::pinhole) std::fill(lens.sd.begin() + 4, lens.sd.end(), 0.0);
    lens.known = lens.lens;
  }
  std::vector<std::optional<BoardPose>> found(views.size());
  parallel_for(static_cast<int>(views.size()), options.threads, [&](int i) {
    const PoseObservation& view = views[static_cast<std::size_t>(i)];
    if (std::cmp_less(view.corners.size(), options.least_corners)) return;
    found[static_cast<std::size_t>(i)] = find_board_pose(
        view.corners, board, work.bundle.lenses[static_cast<std::size_t>(view.camera)].lens);
  });
  for (std::size_t i = 0; i < views.size(); ++i) {
    ViewPose& view = result.views.emplace_back();
    view.name = views[i].name;
    view.corners = static_cast<int>(views[i].corners.size());
    if (view.corners == 0) {
      view.dropped = "does not show the board";
    } else if (view.corners < options.least_corners) {
      view.dropped = fmt::format("shows {} corners of the board only; {} are needed", view.corners,
                                 options.least_corners);
    } else if (!found[i]) {
      view.dropped =
          "its corners of the board lie on a line, or are not where any camera sees them";
    } else {
      BundleView& added = work.bundle.views.emplace_back();
      added.lens = views[i].camera;
      added.corners = views[i].corners;
      added.camera_from_board = found[i]->camera_from_board;
      work.observation.push_back(i);
    }
  }
  return work;
}

std::vector<double> view_errors_px(const Work& work, std::size_t view, const CharucoBoard& board) {
  const BundleView& of = work.bundle.views[view];
  return corner_errors_px(of.corners, board,
                          work.bundle.lenses[static_cast<std::size_t>(of.lens)].lens,
                          of.camera_from_board);
}

std::vector<double> rms_of_views(const Work& work, const CharucoBoard& board) {
  std::vector<double> rms_px;
  for (std::size_t i = 0; i < work.bundle.views.size(); ++i) {
    rms_px.push_back(root_mean_square(view_errors_px(work, i, board)));
  }
  return rms_px;
}

double corner_noise_px(const Work& work, const CharucoBoard& board) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < work.bundle.views.size(); ++i) {
    const std::vector<double> of_view = view_errors_px(work, i, board);
    errors.insert(errors.end(), of_view.begin(), of_view.end());
  }
  // Below a hundredth of a pixel it is rounding, and no measurement.
  return std::max(0.01, median(std::move(errors)) / rayleigh_median);
}

Error unsolvable() {
  return {ErrorKind::no_result, subject, "the bundle adjustment found no solution",
          "look at the pictures and at the lens's params in session.json"};
}

/// A lens that was held, or drawn to its calibration, against what the corners say by themselves.
Result<void> check_lenses(Work work, const std::vector<PoseCamera>& cameras,
                          const CharucoBoard& board, const BoardPoseOptions& options) {
  const std::vector<double> rms_px = rms_of_views(work, board);
  bool all_fit = true;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    std::vector<double> of_camera;
    for (std::size_t i = 0; i < rms_px.size(); ++i) {
      if (std::cmp_equal(work.bundle.views[i].lens, c)) of_camera.push_back(rms_px[i]);
    }
    const BundleLens& lens = work.bundle.lenses[c];
    const double change = std::abs(lens.lens.fx / lens.known.fx - 1.0);
    const bool fits = median(std::move(of_camera)) <= options.worst_median_rms_px;
    all_fit = all_fit && fits;
    if (cameras[c].lens && change > 0.01 * options.most_focal_change_percent) {
      return fail(
          ErrorKind::no_result, fmt::format("camera {}", cameras[c].id),
          fmt::format("its focal length is {:.0f} px as the board shows it, but session.json "
                      "says {:.0f} px",
                      lens.lens.fx, lens.known.fx),
          "calibrate the camera anew; after a change of focus, zoom or lens its params are "
          "others");
    }
  }
  if (all_fit) return {};
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    work.bundle.lenses[c].sd = unknown_sd(work.bundle.lenses[c].lens);
  }
  if (adjust_views(work.bundle, board, std::nullopt) &&
      median(rms_of_views(work, board)) < 0.5 * median(rms_px)) {
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const BundleLens& lens = work.bundle.lenses[c];
      if (std::abs(lens.lens.fx / lens.known.fx - 1.0) < 0.005) continue;
      return fail(ErrorKind::no_result, fmt::format("camera {}", cameras[c].id),
                  fmt::format("its params don't fit the board: session.json says a focal length of "
                              "{:.0f} px, the board shows about {:.0f} px",
                              lens.known.fx, lens.lens.fx),
                  "calibrate the camera anew, or let it be estimated (\"refine\": true)");
    }
  }
  return fail(ErrorKind::no_result, subject,
              fmt::format("the board's corners lie {:.2f} px (median) off where the lens has them; "
                          "{:.2f} px are allowed",
                          median(rms_px), options.worst_median_rms_px),
              "check the board's description and that it is flat, and calibrate the cameras");
}

/// Takes out the views that contradict the others, the worst first.
Result<void> gate_views(Work& work, const CharucoBoard& board, const BoardPoseOptions& options,
                        PoseResult& result) {
  while (true) {
    const std::vector<double> rms_px = rms_of_views(work, board);
    const double typical = median(rms_px);
    const double limit = std::max(options.always_good_rms_px, options.times_median * typical);
    bool dropped = false;
    for (std::size_t i = rms_px.size(); i-- > 0;) {
      // Much worse ones first: they may be what makes others look bad.
      const double worst = *std::max_element(rms_px.begin(), rms_px.end());
      if (rms_px[i] <= std::max(limit, 0.3 * worst)) continue;
      drop_view(work, i,
                fmt::format("its corners of the board lie {:.2f} px off where the board has them; "
                            "in most views it is {:.2f} px",
                            rms_px[i], typical),
                result);
      dropped = true;
    }
    if (!dropped) return {};
    if (const auto enough = check_count(work, result, board, options); !enough)
      return forward(enough);
    if (!adjust_views(work.bundle, board, std::nullopt)) {
      return tl::unexpected<Error>(unsolvable());
    }
  }
}

/// How far rings are to be believed; nothing where the views' errors are not determined.
std::optional<TableTrust> find_trust(Work& work, const CharucoBoard& board) {
  // The axis's bearings and the print are no better than this.
  constexpr double least_departure_mm = 0.01;
  constexpr double reach_mm = 120.0;
  // What is uncertain about a lens moves all views of a ring alike: that is no departure.
  BundleProblem with_fixed_lenses = work.bundle;
  for (BundleLens& lens : with_fixed_lenses.lenses) lens.sd.fill(0.0);
  const auto covariance = covariance_of(with_fixed_lenses, board, std::nullopt);
  if (!covariance || !adjust_rings(work.bundle, reach_mm, 1.0)) return std::nullopt;
  level_rings(work.bundle);
  return trust_in_rings(work.bundle, covariance->views, reach_mm, least_departure_mm);
}

void report_table(const Work& work, const std::vector<PoseObservation>& views,
                  const std::vector<int>& pass_of_axis, const TableTrust& trust,
                  PoseResult& result) {
  for (std::size_t a = 0; a < pass_of_axis.size(); ++a) {
    TableMotion& motion = result.table.emplace_back();
    motion.pass = pass_of_axis[a];
    motion.departure_mm = trust.departure_mm;
    const TableAxis& axis = work.bundle.axes[a];
    motion.table_from_board = axis.table_from_board();
    motion.axis_offset_mm = std::hypot(axis.unknowns[0], axis.unknowns[1]);
    double squares = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < work.bundle.views.size(); ++i) {
      const BundleView& view = work.bundle.views[i];
      if (view.ring < 0) continue;
      const BundleRing& ring = work.bundle.rings[static_cast<std::size_t>(view.ring)];
      if (std::cmp_not_equal(ring.axis, a)) continue;
      const double told_deg = *views[work.observation[i]].table_angle_deg;
      motion.reversed = motion.reversed || view.commanded_rad * told_deg < 0.0;
      const double error_deg = degrees(view.angle_rad - view.commanded_rad);
      squares += error_deg * error_deg;
      ++count;
    }
    motion.angle_rms_deg = std::sqrt(squares / std::max(1, count));
  }
}

void remark_on_angles(const Work& work, const std::vector<PoseObservation>& views,
                      const TableTrust& trust, PoseResult& result) {
  const double limit_deg = std::max(0.5, 6.0 * trust.angle_sd_deg);
  for (std::size_t i = 0; i < work.bundle.views.size(); ++i) {
    const BundleView& view = work.bundle.views[i];
    const double error_deg = degrees(view.angle_rad - view.commanded_rad);
    if (view.ring < 0 || std::abs(error_deg) <= limit_deg) continue;
    ViewPose& about = result.views[work.observation[i]];
    about.remark = fmt::format("the table stood {:+.2f} deg off the {:.2f} deg it was told",
                               error_deg, *views[work.observation[i]].table_angle_deg);
    result.notes.push_back(about.name + ": " + about.remark);
  }
}

void finish_views(const Work& work, const std::vector<PoseObservation>& views,
                  const std::vector<int>& pass_of_axis, const BundleCovariance& covariance,
                  const CharucoBoard& board, PoseResult& result) {
  double squares = 0.0;
  std::size_t corners = 0;
  for (std::size_t i = 0; i < work.bundle.views.size(); ++i) {
    const BundleView& view = work.bundle.views[i];
    ViewPose& about = result.views[work.observation[i]];
    Rigid3 table_from_board;
    for (std::size_t a = 0; a < pass_of_axis.size(); ++a) {
      if (pass_of_axis[a] == views[work.observation[i]].pass) {
        table_from_board = work.bundle.axes[a].table_from_board();
      }
    }
    about.camera_from_table = view.camera_from_board * table_from_board.inverse();
    about.rms_px = root_mean_square(view_errors_px(work, i, board));
    squares += about.rms_px * about.rms_px * about.corners;
    corners += view.corners.size();
    // The centre is -R't; a motion (w, d) in the camera's frame moves it by -R'(d + t x w).
    const Eigen::Vector3d& t = view.camera_from_board.translation;
    Eigen::Matrix<double, 3, 6> by_motion;
    by_motion << 0.0, -t.z(), t.y(), 1.0, 0.0, 0.0,  //
        t.z(), 0.0, -t.x(), 0.0, 1.0, 0.0,           //
        -t.y(), t.x(), 0.0, 0.0, 0.0, 1.0;
    const Eigen::Matrix<double, 6, 6>& c = covariance.views[i];
    about.position_error_mm = std::sqrt((by_motion * c * by_motion.transpose()).trace());
    about.rotation_error_deg = degrees(std::sqrt(c.topLeftCorner<3, 3>().trace()));
  }
  result.rms_px = std::sqrt(squares / static_cast<double>(corners));
}

Result<void> check_given_scale(const std::vector<PoseObservation>& views,
                               const BoardPoseOptions& options, const PoseResult& result) {
  std::vector<Rigid3> given;
  std::vector<Rigid3> found;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].given || !result.views[i].used()) continue;
    given.push_back(*views[i].given);
    found.push_back(result.views[i].camera_from_table);
  }
  constexpr double least_spread_mm = 10.0;
  const auto scale = scale_between(given, found, least_spread_mm);
  if (!scale || std::abs(*scale - 1.0) <= 0.01 * options.most_scale_difference_percent) return {};
  return fail(ErrorKind::no_result, subject,
              fmt::format("by the board everything is {:.2f} % {} than by the poses that came with "
                          "the session",
                          100.0 * std::abs(*scale - 1.0), *scale > 1.0 ? "larger" : "smaller"),
              "measure a row of the board's squares with a ruler and correct square_mm and "
              "marker_mm, or the poses");
}

Result<void> check_input(const std::vector<PoseObservation>& views,
                         const std::vector<PoseCamera>& cameras, const CharucoBoard& board,
                         const BoardPoseOptions& options) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (const auto valid = board.validate(); !valid) return forward(valid);
  for (const PoseObservation& view : views) {
    if (view.camera < 0 || std::cmp_greater_equal(view.camera, cameras.size())) {
      return fail(ErrorKind::bad_input, view.name, "was taken by a camera that is not listed");
    }
    for (const BoardCorner& corner : view.corners) {
      if (corner.id < 0 || corner.id >= board.corner_count()) {
        return fail(ErrorKind::bad_input, view.name,
                    fmt::format("corner {} is not the board's", corner.id));
      }
    }
  }
  return {};
}

}  // namespace

Result<void> BoardPoseOptions::validate() const {
  if (least_corners < 6 || least_views < 1 || !(always_good_rms_px > 0.0) ||
      !(times_median >= 1.0) || !(worst_median_rms_px > 0.0) || !(focal_sd_percent > 0.0) ||
      !(centre_sd_percent > 0.0) || !(radial_sd > 0.0) || !(tangential_sd > 0.0) ||
      !(most_focal_change_percent > 0.0) || !(most_scale_difference_percent > 0.0)) {
    return fail(ErrorKind::bad_input, "board pose options", "are out of their range");
  }
  return {};
}

Result<PoseResult> poses_from_board(const std::vector<PoseObservation>& views,
                                    const std::vector<PoseCamera>& cameras,
                                    const CharucoBoard& board, const BoardPoseOptions& options,
                                    const Progress& progress) {
  if (const auto good = check_input(views, cameras, board, options); !good) return forward(good);
  PoseResult result;
  progress.report(0.0, "finding the board in each view");
  Work work = begin(views, cameras, board, options, result);
  if (const auto good = check_count(work, result, board, options); !good) return forward(good);

  progress.report(0.3, "adjusting the cameras");
  if (!adjust_views(work.bundle, board, std::nullopt)) return tl::unexpected<Error>(unsolvable());
  if (const auto good = check_lenses(work, cameras, board, options); !good) return forward(good);
  if (const auto good = gate_views(work, board, options, result); !good) return forward(good);
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, subject, "stopped");

  work.bundle.corner_sd_px = corner_noise_px(work, board);
  if (!adjust_views(work.bundle, board, std::nullopt)) return tl::unexpected<Error>(unsolvable());
  progress.report(0.6, "adjusting table and cameras");
  std::vector<RingMembership> members;
  for (const std::size_t i : work.observation) {
    members.push_back({views[i].camera, views[i].pass, views[i].table_angle_deg});
  }
  const std::vector<int> pass_of_axis = begin_rings(work.bundle, members);
  const std::optional<TableTrust> trust =
      pass_of_axis.empty() ? std::nullopt : find_trust(work, board);
  if (trust && !adjust_views(work.bundle, board, trust)) {
    return tl::unexpected<Error>(unsolvable());
  }
  const auto covariance = covariance_of(work.bundle, board, trust);
  if (!covariance) {
    return fail(ErrorKind::no_result, subject, "the corners seen don't determine all poses",
                "make more of the board visible beside the specimen");
  }
  finish_views(work, views, pass_of_axis, *covariance, board, result);
  if (trust) {
    report_table(work, views, pass_of_axis, *trust, result);
    remark_on_angles(work, views, *trust, result);
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    result.lenses.push_back({work.bundle.lenses[c].lens, covariance->lens_sd[c][0]});
  }
  result.scale = ScaleSource::board;
  result.scale_error_percent = 100.0 * covariance->scale_sd;
  result.corner_noise_px = corner_noise_px(work, board);
  if (const auto good = check_given_scale(views, options, result); !good) return forward(good);
  progress.report(1.0, "poses are known");
  return result;
}

}  // namespace skullstation
