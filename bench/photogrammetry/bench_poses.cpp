// Poses and masks of sessions whose truth is known: how far off, how fast.
//   bench_poses [--masks DIR] [--sfm RADIUS_MM] SESSION ...
// SESSION: folders as `skullstation scan` makes them on the simulated station
// (simulation_truth.json), or with true poses and masks in session.json. --masks writes every
// eighth mask to DIR. --sfm forgets the board and the poses: structure from motion, its scale from
// the table's angles and the first camera's distance from the axis.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "bench/photogrammetry/simulation_truth.h"
#include "bench/seconds.h"
#include "core/file.h"
#include "core/session/image_file.h"
#include "reconstruction/photogrammetry/masks.h"
#include "reconstruction/photogrammetry/poses_session.h"
#include "reconstruction/photogrammetry/scale_check.h"

namespace {

using namespace skullstation;
namespace fs = std::filesystem;

/// Seconds since the last look.
class StopWatch {
 public:
  std::string look() {
    const Seconds passed = Seconds::now() - began_;
    began_ = Seconds::now();
    return fmt::format("{:6.2f} s wall {:6.2f} s CPU", passed.wall, passed.processor);
  }

 private:
  Seconds began_ = Seconds::now();
};

/// camera_from_board of every view, as the simulation had it; empty without a truth.
std::vector<Rigid3> true_poses(const Session& session, const fs::path& folder) {
  std::vector<Rigid3> poses;
  const auto truth = read_simulation_truth(folder);
  if (!truth) {
    for (const SessionView& view : session.views) {
      if (view.camera_from_table) poses.push_back(*view.camera_from_table);
    }
    return poses.size() == session.views.size() ? poses : std::vector<Rigid3>{};
  }
  for (const SessionView& view : session.views) {
    poses.push_back(truth->camera_from_station.at(view.camera) *
                    rotation_about_z(truth->table_angle_deg.at(view.image)));
  }
  return poses;
}

/// The rotation about z and shift along z by which the found frame may differ from the true one:
/// the board lies on the platter a little askew.
Rigid3 frame_difference(const std::vector<Rigid3>& truth, const PoseResult& found) {
  double sine = 0.0;
  double cosine = 0.0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  int used = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!found.views[i].used()) continue;
    const Rigid3 d = truth[i].inverse() * found.views[i].camera_from_table;
    sine += 2.0 * d.rotation.w() * d.rotation.z();
    cosine += 1.0 - 2.0 * d.rotation.z() * d.rotation.z();
    shift += d.translation;
    ++used;
  }
  Rigid3 difference = rotation_about_z(std::atan2(sine, cosine) * 180.0 / M_PI);
  difference.translation.z() = shift.z() / used;
  return difference;
}

void print_accuracy(const std::vector<Rigid3>& truth, const PoseResult& found) {
  const Rigid3 frame = frame_difference(truth, found);
  std::vector<Rigid3> true_used;
  std::vector<Rigid3> found_used;
  double sum_mm = 0.0;
  double worst_mm = 0.0;
  double worst_deg = 0.0;
  double predicted_mm = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const ViewPose& view = found.views[i];
    if (!view.used()) continue;
    const Rigid3 expected = truth[i] * frame;
    const double off_mm =
        (expected.inverse().translation - view.camera_from_table.inverse().translation).norm();
    sum_mm += off_mm;
    worst_mm = std::max(worst_mm, off_mm);
    worst_deg = std::max(worst_deg, rotation_distance_deg(expected, view.camera_from_table));
    predicted_mm = std::max(predicted_mm, view.position_error_mm);
    true_used.push_back(expected);
    found_used.push_back(view.camera_from_table);
  }
  const auto scale = scale_between(true_used, found_used, 1.0);
  fmt::print(
      "  centres {:.3f} mm mean, {:.3f} mm worst (predicted {:.3f}); rotation {:.4f} deg "
      "worst; scale {:+.4f} %\n",
      sum_mm / static_cast<double>(true_used.size()), worst_mm, predicted_mm, worst_deg,
      100.0 * (scale.value_or(0.0) - 1.0));
}

void print_masks(const Session& session, const fs::path& folder, const fs::path& masks_folder,
                 const std::vector<Image8>& photographs, const PoseResult& found) {
  StopWatch watch;
  std::vector<MaskView> views;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < session.views.size(); ++i) {
    if (!found.views[i].used() || session.views[i].pass != 0) continue;
    std::size_t camera = 0;
    while (session.cameras[camera].id != session.views[i].camera) ++camera;
    const Rigid3& pose = found.views[i].camera_from_table;
    views.push_back({&photographs[i], found.lenses[camera].lens, pose,
                     session.board
                         ? std::optional(pose * found.table_from_board(session.views[i].pass))
                         : std::nullopt});
    index.push_back(i);
  }
  const auto masks = find_masks(views, session.board ? &*session.board : nullptr);
  if (!masks) {
    fmt::print("  masks: {}\n", masks.error().message());
    return;
  }
  fmt::print("  masks of {} views: {}\n", views.size(), watch.look());
  double sum = 0.0;
  double worst = 1.0;
  int compared = 0;
  for (std::size_t i = 0; i < masks->size(); ++i) {
    const SessionView& view = session.views[index[i]];
    if (!(*masks)[i].odd.empty()) fmt::print("  {}: {}\n", view.image, (*masks)[i].odd);
    if (i % 8 == 0 && !masks_folder.empty()) {
      const auto name = fmt::format("{}_{}.png", folder.filename().string(), i);
      if (!write_file_durably(masks_folder / name, encode_png((*masks)[i].mask))) continue;
    }
    if (!view.mask) continue;
    const auto truth = read_image(folder / *view.mask);
    if (!truth) continue;
    const double overlap = mask_overlap((*masks)[i].mask, *truth);
    sum += overlap;
    worst = std::min(worst, overlap);
    ++compared;
  }
  if (compared > 0) {
    fmt::print("  mask against truth, intersection over union: {:.4f} mean, {:.4f} worst\n",
               sum / compared, worst);
  }
}

int run_session(const fs::path& folder, const fs::path& masks_folder,
                std::optional<double> sfm_radius_mm) {
  Result<Session> session = read_session(folder);
  if (!session) {
    fmt::print(stderr, "{}\n", session.error().message());
    return 1;
  }
  StopWatch watch;
  const auto photographs = read_photographs(*session, folder, 0);
  if (!photographs) {
    fmt::print(stderr, "{}\n", photographs.error().message());
    return 1;
  }
  const std::vector<Rigid3> truth = true_poses(*session, folder);
  fmt::print("{}: {} views\n  reading: {}\n", folder.string(), session->views.size(), watch.look());
  for (SessionView& view : session->views) view.camera_from_table.reset();
  PoseOptions options;
  if (sfm_radius_mm) {
    session->board.reset();
    for (SessionCamera& camera : session->cameras) camera.refine = false;
    options.method = PoseMethod::motion;
    options.motion.camera_radius_mm = sfm_radius_mm;
  }
  const auto observations = pose_observations(*session, *photographs, 0);
  fmt::print("  board corners: {}\n", watch.look());
  const auto found = find_poses(*session, *photographs, observations, options);
  if (!found) {
    fmt::print("  poses: {}\n", found.error().message());
    return 1;
  }
  fmt::print("  poses: {}; {:.3f} px RMS, corner noise {:.3f} px, scale error {:.4f} % (1 sd)\n",
             watch.look(), found->rms_px, found->corner_noise_px, found->scale_error_percent);
  for (std::size_t c = 0; c < found->lenses.size(); ++c) {
    const Lens& lens = found->lenses[c].lens;
    fmt::print("  lens {}: fx {:.1f} +- {:.1f}, cx {:.1f}, cy {:.1f}, k1 {:.4f}\n",
               session->cameras[c].id, lens.fx, found->lenses[c].focal_error_px, lens.cx, lens.cy,
               lens.k1);
  }
  for (const TableMotion& table : found->table) {
    fmt::print("  table, pass {}: angles {:.3f} deg RMS off, departs {:.3f} mm from a rotation\n",
               table.pass, table.angle_rms_deg, table.departure_mm);
  }
  for (const ViewPose& view : found->views) {
    if (!view.used()) fmt::print("  dropped {}: {}\n", view.name, view.dropped);
  }
  if (!truth.empty()) print_accuracy(truth, *found);
  print_masks(*session, folder, masks_folder, *photographs, *found);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  int failed = 0;
  std::string masks_folder;
  std::optional<double> sfm_radius_mm;
  std::vector<std::string> sessions;
  CLI::App app{"poses and masks of sessions whose truth is known"};
  app.add_option("--masks", masks_folder, "writes every eighth mask there");
  app.add_option("--sfm", sfm_radius_mm, "without board: the first camera's radius [mm]");
  app.add_option("sessions", sessions)->required();
  CLI11_PARSE(app, argc, argv);
  for (const std::string& session : sessions) {
    failed += run_session(session, masks_folder, sfm_radius_mm);
  }
  return failed == 0 ? 0 : 1;
}
