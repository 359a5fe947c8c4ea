#pragma once

#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/session/session.h"
#include "reconstruction/photogrammetry/poses_join.h"
#include "reconstruction/photogrammetry/poses_session.h"
#include "reconstruction/photogrammetry/reconstruct_surface.h"

namespace skullstation {

struct ReconstructionOptions {
  PoseOptions poses;
  ReconstructionQuality quality = ReconstructionQuality::standard;
  double closed_rim_mm = 0.0;  ///< SurfaceOptions::closed_rim_mm
  std::uint64_t seed = 1;
  int threads = 0;
};

/// A pass that was joined to the first.
struct JoinedPass {
  int pass = 0;
  PassJoin join;
};

struct SessionReconstruction {
  /// The session with poses and refined intrinsics filled in, in the frame of the first pass; views
  /// that are not used have no pose.
  Session cameras;
  PoseResult poses;  ///< as found, each pass in its own frame
  std::vector<JoinedPass> joined;
  ReconstructedSurface surface;  ///< table frame of the first pass, mm
};

/// The masks that the session names, empty where it names none. Errors (bad_input) name the file.
Result<std::vector<Image8>> read_given_masks(const Session& session,
                                             const std::filesystem::path& folder);

/// From photographs to a metric surface: poses, masks (`given_masks` where they are not empty),
/// stereo; the passes joined first where there are several. Views that contradict the others are
/// dropped and named in `poses`. Errors: those of the stages, with the reason and the remedy.
Result<SessionReconstruction> reconstruct_session(const Session& session,
                                                  const std::vector<Image8>& photographs,
                                                  const std::vector<Image8>& given_masks,
                                                  const ReconstructionOptions& options,
                                                  const Progress& progress = {});

}  // namespace skullstation
