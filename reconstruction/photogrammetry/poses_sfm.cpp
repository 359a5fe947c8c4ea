#include "reconstruction/photogrammetry/poses_sfm.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "core/median.h"
#include "core/parallel.h"
#include "core/root_mean_square.h"
#include "core/session/board_pose.h"
#include "core/units.h"
#include "reconstruction/photogrammetry/colmap_model.h"
#include "reconstruction/photogrammetry/masks_evidence.h"
#include "reconstruction/photogrammetry/sfm_frame.h"
#include "reconstruction/photogrammetry/sfm_rings.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr const char* subject = "structure from motion";

/// A folder of its own that goes with the scope.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "skullstation-sfm-XXXXXX").string();
    if (!error && ::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// All of the photograph but the backdrop, which stands still while the specimen turns: its
/// features would hold the cameras in one place. Empty where nearly all would be backdrop.
Image8 feature_mask(const Image8& photograph) {
  const MaskView view{&photograph, {}, {}, std::nullopt};
  const Image<MaskEvidence> evidence = find_mask_evidence(view, nullptr, {}, 1);
  Image8 mask(photograph.width, photograph.height, 1);
  std::size_t kept = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const int column = std::min(x / kMaskScale, evidence.width - 1);
      const int row = std::min(y / kMaskScale, evidence.height - 1);
      if (evidence.at(column, row) == MaskEvidence::background) continue;
      mask.at(x, y) = 255;
      ++kept;
    }
  }
  constexpr double least_share = 0.02;
  const double share = static_cast<double>(kept) / static_cast<double>(mask.pixels.size());
  return share < least_share ? Image8{} : mask;
}

/// One pass on its way to poses.
struct PassMotion {
  std::vector<std::size_t> views;  ///< indices of the observations
  SfmModel model;
  /// x_frame of the model's points; the frame's unit is mm unless the scale is unknown.
  Similarity3 frame_from_model;
  ScaleSource scale = ScaleSource::unknown;
  double scale_error_percent = 0.0;
};

class MotionPoses {
 public:
  MotionPoses(const std::vector<PoseObservation>& views, const std::vector<Image8>& photographs,
              const std::vector<PoseCamera>& cameras, const std::optional<CharucoBoard>& board,
              const MotionPoseOptions& options)
      : views_(views),
        photographs_(photographs),
        cameras_(cameras),
        board_(board),
        options_(options) {
    for (const PoseObservation& view : views) {
      ViewPose& pose = result_.views.emplace_back();
      pose.name = view.name;
      pose.corners = static_cast<int>(view.corners.size());
    }
    for (const PoseCamera& camera : cameras) {
      sfm_cameras_.push_back({camera.width, camera.height, camera.lens});
      result_.lenses.push_back({camera.lens.value_or(Lens{}), 0.0});
    }
  }

  Result<void> find_pass(PassMotion& pass, const Progress& progress) {
    const ScratchFolder scratch;
    if (scratch.path().empty()) {
      return fail(ErrorKind::bad_input, "temporary folder", "can't be made", "set TMPDIR");
    }
    std::vector<SfmImage> images(pass.views.size());
    parallel_for(static_cast<int>(images.size()), options_.threads, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      const std::size_t view = pass.views[at];
      images[at] = {views_[view].camera, &photographs_[view], feature_mask(photographs_[view])};
    });
    std::vector<PoseObservation> of_pass;
    for (const std::size_t view : pass.views) of_pass.push_back(views_[view]);
    const SfmOptions how{options_.colmap, scratch.path(), options_.seed, options_.threads};
    auto model = structure_from_motion(images, sfm_cameras_, pairs_to_match(of_pass, cameras_), how,
                                       progress);
    if (!model) return forward(model);
    pass.model = *std::move(model);
    for (std::size_t c = 0; c < sfm_cameras_.size(); ++c) {
      if (sfm_cameras_[c].lens || !(pass.model.lenses[c].fx > 0.0)) continue;
      // Later passes were taken by the same lens.
      sfm_cameras_[c].lens = result_.lenses[c].lens = pass.model.lenses[c];
    }
    gate_by_points(pass);
    place(pass);
    return use_rings(pass);
  }

  void finish_pass(const PassMotion& pass) {
    for (std::size_t i = 0; i < pass.views.size(); ++i) {
      if (!usable(pass, i)) continue;
      result_.views[pass.views[i]].camera_from_table =
          in_reference(*pass.model.camera_from_model[i], pass.frame_from_model);
    }
    result_.scale = pass.scale;
    result_.scale_error_percent = std::max(result_.scale_error_percent, pass.scale_error_percent);
  }

  PoseResult take() {
    double squares = 0.0;
    int used = 0;
    for (const ViewPose& view : result_.views) {
      if (!view.used()) continue;
      squares += view.rms_px * view.rms_px;
      ++used;
    }
    result_.rms_px = std::sqrt(squares / std::max(1, used));
    if (result_.scale == ScaleSource::unknown) {
      result_.notes.emplace_back(
          "nothing tells the scale: lengths are in units of a thousandth of the cameras' distance; "
          "lay a board under the specimen, or say how far the camera stands from the axis");
    }
    return std::move(result_);
  }

 private:
  bool usable(const PassMotion& pass, std::size_t i) const {
    return pass.model.camera_from_model[i] && result_.views[pass.views[i]].used();
  }
  ViewPose& view_of(const PassMotion& pass, std::size_t i) { return result_.views[pass.views[i]]; }

  /// Drops views that share too little with the others or lie off what the others say.
  void gate_by_points(const PassMotion& pass) {
    std::vector<std::vector<double>> errors_px(pass.views.size());
    for (const SfmPoint& point : pass.model.points) {
      for (const SfmPoint::Sight& sight : point.sights) {
        const auto i = static_cast<std::size_t>(sight.image);
        const auto& camera = pass.model.camera_from_model[i];
        const auto lens = static_cast<std::size_t>(views_[pass.views[i]].camera);
        if (!camera) continue;
        const Eigen::Vector2d px = pass.model.lenses[lens].project(*camera * point.x_model);
        errors_px[i].push_back((px - sight.position_px).norm());
      }
    }
    std::vector<double> rms_px;
    for (std::size_t i = 0; i < pass.views.size(); ++i) {
      view_of(pass, i).points = static_cast<int>(errors_px[i].size());
      view_of(pass, i).rms_px = root_mean_square(errors_px[i]);
      if (!errors_px[i].empty()) rms_px.push_back(view_of(pass, i).rms_px);
    }
    const double typical = median(std::move(rms_px));
    const double limit = std::max(options_.always_good_rms_px, options_.times_median * typical);
    for (std::size_t i = 0; i < pass.views.size(); ++i) {
      ViewPose& view = view_of(pass, i);
      if (!view.used()) continue;
      if (!pass.model.camera_from_model[i]) {
        view.dropped = "shows nothing that connects it to the other views";
      } else if (view.points < options_.least_points) {
        view.dropped = fmt::format("shares {} points with other views only; {} are needed",
                                   view.points, options_.least_points);
      } else if (view.rms_px > limit) {
        view.dropped = fmt::format(
            "its points lie {:.2f} px off where the other views have them; in most it is {:.2f} px",
            view.rms_px, typical);
      }
    }
  }

  /// Cameras known in the model and by another source.
  std::vector<FramePair> known_by(const PassMotion& pass, ScaleSource source) const {
    constexpr std::size_t least_corners = 12;
    std::vector<FramePair> known;
    for (std::size_t i = 0; i < pass.views.size(); ++i) {
      if (!usable(pass, i)) continue;
      const PoseObservation& view = views_[pass.views[i]];
      std::optional<Rigid3> reference;
      if (source == ScaleSource::given_poses) reference = view.given;
      if (source == ScaleSource::board && view.corners.size() >= least_corners) {
        const auto lens = static_cast<std::size_t>(view.camera);
        const auto found = find_board_pose(view.corners, *board_, pass.model.lenses[lens]);
        if (found) reference = found->camera_from_board;
      }
      if (reference) known.push_back({*reference, *pass.model.camera_from_model[i]});
    }
    return known;
  }

  /// Frame and scale, by the best that there is.
  void place(PassMotion& pass) {
    for (const ScaleSource source : {ScaleSource::board, ScaleSource::given_poses}) {
      if (source == ScaleSource::board && !board_) continue;
      const auto fit = fit_frame(known_by(pass, source));
      if (!fit) continue;
      pass.frame_from_model = fit->reference_from_model;
      pass.scale = source;
      pass.scale_error_percent = fit->scale_error_percent;
      return;
    }
    std::vector<Rigid3> cameras;
    for (std::size_t i = 0; i < pass.views.size(); ++i) {
      if (usable(pass, i)) cameras.push_back(*pass.model.camera_from_model[i]);
    }
    constexpr double unknown_distance = 1000.0;
    if (cameras.size() >= 2) pass.frame_from_model = frame_of_cameras(cameras, unknown_distance);
  }

  RingMembers members_of(const PassMotion& pass) const {
    RingMembers members(pass.views.size());
    for (std::size_t i = 0; i < pass.views.size(); ++i) {
      const PoseObservation& view = views_[pass.views[i]];
      if (!usable(pass, i) || !view.table_angle_deg) continue;
      members[i] = {view.camera, view.pass, view.table_angle_deg};
    }
    return members;
  }

  /// With table angles: adjusts views to what they show and to their circles, drops those that are
  /// off their circle all the same, and makes the axis the frame's z where the frame is not a given
  /// one.
  Result<void> use_rings(PassMotion& pass) {
    adjust_to_rings(pass.model, pass.frame_from_model, members_of(pass));
    gate_by_points(pass);
    if (pass.scale != ScaleSource::unknown) place(pass);
    auto rings = find_sfm_rings(pass.model, pass.frame_from_model, members_of(pass));
    if (rings && drop_departures(pass, *rings)) {
      rings = find_sfm_rings(pass.model, pass.frame_from_model, members_of(pass));
    }
    if (!rings) {
      if (pass.scale != ScaleSource::unknown || !options_.camera_radius_mm) return {};
      return fail(ErrorKind::no_result, subject,
                  "no axis is found, so that the camera's distance from it tells no scale",
                  "give the views their table_angle_deg, or lay a board under the specimen");
    }
    if (pass.scale != ScaleSource::given_poses) use_axis(*rings, pass);
    return {};
  }

  bool drop_departures(const PassMotion& pass, const SfmRings& rings) {
    const double typical = median(rings.departures_mm);
    bool dropped = false;
    for (std::size_t k = 0; k < rings.images.size(); ++k) {
      const double distance = rings.problem.views[k].camera_from_board.translation.norm();
      const double limit = std::max(options_.always_good_departure * distance,
                                    options_.times_median_departure * typical);
      if (rings.departures_mm[k] <= limit) continue;
      view_of(pass, rings.images[k]).dropped = fmt::format(
          "it is {:.1f} mm off the place where the table's angle has it; in most views it is "
          "{:.1f} mm",
          rings.departures_mm[k], typical);
      dropped = true;
    }
    return dropped;
  }

  void use_axis(const SfmRings& rings, PassMotion& pass) {
    const BundleProblem& problem = rings.problem;
    const Rigid3 table_from_frame = problem.axes.front().table_from_board();
    double scale = 1.0;
    if (pass.scale == ScaleSource::unknown && options_.camera_radius_mm) {
      const Rigid3 station = problem.rings.front().camera_from_station.inverse();
      scale = *options_.camera_radius_mm / station.translation.head<2>().norm();
      pass.scale = ScaleSource::camera_radius;
    }
    const Similarity3 table{scale, table_from_frame.rotation, scale * table_from_frame.translation};
    pass.frame_from_model = table * pass.frame_from_model;
    TableMotion motion;
    motion.pass = views_[pass.views.front()].pass;
    motion.departure_mm = scale * median(rings.departures_mm);
    motion.table_from_board = {table_from_frame.rotation, scale * table_from_frame.translation};
    motion.axis_offset_mm = motion.table_from_board.translation.head<2>().norm();
    double squares = 0.0;
    for (const BundleView& view : problem.views) {
      const double error_deg = degrees(view.angle_rad - view.commanded_rad);
      squares += error_deg * error_deg;
    }
    motion.angle_rms_deg = std::sqrt(squares / static_cast<double>(problem.views.size()));
    result_.table.push_back(motion);
  }

  const std::vector<PoseObservation>& views_;
  const std::vector<Image8>& photographs_;
  const std::vector<PoseCamera>& cameras_;
  const std::optional<CharucoBoard>& board_;
  const MotionPoseOptions& options_;
  std::vector<SfmCamera> sfm_cameras_;
  PoseResult result_;
};

}  // namespace

Result<PoseResult> poses_from_motion(const std::vector<PoseObservation>& views,
                                     const std::vector<Image8>& photographs,
                                     const std::vector<PoseCamera>& cameras,
                                     const std::optional<CharucoBoard>& board,
                                     const MotionPoseOptions& options, const Progress& progress) {
  std::map<int, PassMotion> passes;
  for (std::size_t i = 0; i < views.size(); ++i) passes[views[i].pass].views.push_back(i);
  MotionPoses search(views, photographs, cameras, board, options);
  double done = 0.0;
  const double share = 1.0 / static_cast<double>(std::max<std::size_t>(1, passes.size()));
  for (auto& [number, pass] : passes) {
    if (pass.views.size() < 3) {
      return fail(ErrorKind::no_result, fmt::format("pass {}", number),
                  fmt::format("has {} views, 3 are needed", pass.views.size()), "take more views");
    }
    const auto found = search.find_pass(pass, progress.part(done, done + share));
    if (!found) return forward(found);
    if (pass.scale != passes.begin()->second.scale) {
      return fail(ErrorKind::no_result, fmt::format("pass {}", number),
                  fmt::format("has its scale from {}, the first pass from {}",
                              to_string(pass.scale), to_string(passes.begin()->second.scale)),
                  "lay the board under the specimen in all passes");
    }
    search.finish_pass(pass);
    done += share;
  }
  PoseResult result = search.take();
  if (result.scale == ScaleSource::unknown && passes.size() > 1) {
    return fail(ErrorKind::no_result, subject,
                "nothing tells the scale, so that the passes can't be joined",
                "lay a board under the specimen, or say how far the camera stands from the axis");
  }
  progress.report(1.0, "poses are known");
  return result;
}

}  // namespace skullstation
