#pragma once

#include <filesystem>
#include <vector>

#include "core/image.h"
#include "core/progress.h"
#include "core/result.h"
#include "core/session/session.h"
#include "reconstruction/photogrammetry/poses_board.h"
#include "reconstruction/photogrammetry/poses_sfm.h"

namespace skullstation {

/// Where a session's poses come from.
enum class PoseMethod {
  automatic,  ///< the board where there is one, else the poses that came with the session, else
              ///< motion
  board,
  given,
  motion  ///< structure from motion over the specimen's own features
};

struct PoseOptions {
  PoseMethod method = PoseMethod::automatic;
  BoardPoseOptions board;
  MotionPoseOptions motion;
  int threads = 0;
};

/// The session's photographs in the order of its views, verified against their hashes. Errors
/// (bad_input) name the file: missing, damaged, or not of its camera's size.
Result<std::vector<Image8>> read_photographs(const Session& session,
                                             const std::filesystem::path& folder, int threads,
                                             const Progress& progress = {});

/// What the poses' search needs of the session's cameras.
std::vector<PoseCamera> pose_cameras(const Session& session);

/// What the poses' search needs of the views: angles, given poses and, with a board in the session,
/// its corners in the photographs.
std::vector<PoseObservation> pose_observations(const Session& session,
                                               const std::vector<Image8>& photographs, int threads);

/// The poses by the method asked for. Views without one are dropped and named. Errors: `bad_input`
/// where the session lacks what the method needs, else those of poses_from_board()
/// and poses_from_motion().
Result<PoseResult> find_poses(const Session& session, const std::vector<Image8>& photographs,
                              const std::vector<PoseObservation>& observations,
                              const PoseOptions& options, const Progress& progress = {});

}  // namespace skullstation
