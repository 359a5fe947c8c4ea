#include "reconstruction/photogrammetry/poses_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "core/parallel.h"
#include "core/session/image_file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

const SessionCamera& camera_of(const Session& session, const SessionView& view) {
  return *std::ranges::find(session.cameras, view.camera, &SessionCamera::id);
}

Result<Image8> read_photograph(const Session& session, const SessionView& view,
                               const fs::path& folder) {
  if (const auto intact = verify_image(view, folder); !intact) return forward(intact);
  Result<Image8> image = read_image(folder / view.image);
  if (!image) return image;
  const SessionCamera& camera = camera_of(session, view);
  if (image->width != camera.width || image->height != camera.height) {
    return fail(ErrorKind::bad_input, (folder / view.image).string(),
                fmt::format("is {} x {} px; camera {} takes {} x {} px", image->width,
                            image->height, camera.id, camera.width, camera.height),
                "give pictures of another size or orientation a camera of their own");
  }
  return image;
}

Result<PoseResult> given_poses(const Session& session,
                               const std::vector<PoseObservation>& observations) {
  PoseResult result;
  for (const SessionCamera& camera : session.cameras) {
    const bool in_use = std::ranges::any_of(session.views, [&](const SessionView& view) {
      return view.camera == camera.id && view.camera_from_table;
    });
    if (!camera.params && in_use) {
      return fail(ErrorKind::bad_input, fmt::format("camera {}", camera.id),
                  "has no params, without which given poses are of no use",
                  "add its intrinsics to session.json");
    }
    AdjustedLens& lens = result.lenses.emplace_back();
    if (camera.params) {
      lens.lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
    }
  }
  int used = 0;
  for (const PoseObservation& observation : observations) {
    ViewPose& view = result.views.emplace_back();
    view.name = observation.name;
    view.corners = static_cast<int>(observation.corners.size());
    if (observation.given) {
      view.camera_from_table = *observation.given;
      ++used;
    } else {
      view.dropped = "has no camera_from_table in session.json";
    }
  }
  if (used < 3) {
    return fail(ErrorKind::no_result, "given poses",
                fmt::format("{} of {} views have a camera_from_table, 3 are needed", used,
                            observations.size()),
                "let the poses be found from the board");
  }
  result.scale = ScaleSource::given_poses;
  return result;
}

}  // namespace

Result<std::vector<Image8>> read_photographs(const Session& session, const fs::path& folder,
                                             int threads, const Progress& progress) {
  std::vector<Image8> photographs(session.views.size());
  std::vector<std::optional<Error>> errors(session.views.size());
  std::atomic<int> done{0};
  std::mutex reporting;
  parallel_for(static_cast<int>(session.views.size()), threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    if (progress.stop.stop_requested()) return;
    Result<Image8> read = read_photograph(session, session.views[at], folder);
    if (read) {
      photographs[at] = *std::move(read);
    } else {
      errors[at] = read.error();
    }
    const std::lock_guard lock(reporting);
    progress.report(++done / static_cast<double>(session.views.size()), "reading the photographs");
  });
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "reading", "stopped");
  for (const auto& error : errors) {
    if (error) return tl::unexpected<Error>(*error);
  }
  return photographs;
}

std::vector<PoseCamera> pose_cameras(const Session& session) {
  std::vector<PoseCamera> cameras;
  for (const SessionCamera& camera : session.cameras) {
    PoseCamera& added = cameras.emplace_back();
    added.id = camera.id;
    added.width = camera.width;
    added.height = camera.height;
    added.model = camera.model;
    added.refine = camera.refine;
    if (camera.params) {
      added.lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
    }
  }
  return cameras;
}

std::vector<PoseObservation> pose_observations(const Session& session,
                                               const std::vector<Image8>& photographs,
                                               int threads) {
  std::vector<PoseObservation> observations(session.views.size());
  parallel_for(static_cast<int>(session.views.size()), threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const SessionView& view = session.views[at];
    PoseObservation& observation = observations[at];
    observation.name = view.image;
    observation.camera = static_cast<int>(&camera_of(session, view) - session.cameras.data());
    observation.pass = view.pass;
    observation.table_angle_deg = view.table_angle_deg;
    observation.given = view.camera_from_table;
    if (session.board) observation.corners = detect_board(photographs[at], *session.board);
  });
  return observations;
}

Result<PoseResult> find_poses(const Session& session, const std::vector<Image8>& photographs,
                              const std::vector<PoseObservation>& observations,
                              const PoseOptions& options, const Progress& progress) {
  PoseMethod method = options.method;
  const bool given = std::ranges::any_of(
      session.views, [](const SessionView& view) { return view.camera_from_table.has_value(); });
  if (method == PoseMethod::automatic) {
    if (session.board) {
      method = PoseMethod::board;
    } else {
      method = given ? PoseMethod::given : PoseMethod::motion;
    }
  }
  if (method == PoseMethod::given) return given_poses(session, observations);
  if (method == PoseMethod::motion) {
    MotionPoseOptions motion = options.motion;
    motion.threads = options.threads;
    return poses_from_motion(observations, photographs, pose_cameras(session), session.board,
                             motion, progress);
  }
  if (!session.board) {
    return fail(ErrorKind::bad_input, "session.json", "describes no board to find poses from",
                "add \"board\", or use the poses that are given");
  }
  BoardPoseOptions board = options.board;
  board.threads = options.threads;
  return poses_from_board(observations, pose_cameras(session), *session.board, board, progress);
}

}  // namespace skullstation
