#pragma once

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

struct PassJoinOptions {
  /// Of the second pass's surface, what must lie on the first's: both see the specimen's sides.
  double least_overlap = 0.35;
  double worst_rms_mm = 0.6;  ///< over that
  /// The best place elsewhere must fit so many times worse, or the join is a guess.
  double least_runner_up = 1.15;
  std::uint64_t seed = 1;
  int threads = 0;
};

/// How the specimen was moved between two passes.
struct PassJoin {
  Rigid3 first_from_second;
  double overlap = 0.0;
  double rms_mm = 0.0;
  double runner_up = 0.0;  ///< cost of the best place elsewhere, in units of this one's; 0: none
};

/// Finds the second surface on the first: global registration, then point-to-plane ICP on pairs
/// within 2 mm and half a millimetre. Refuses (`no_result`) where too little overlaps, the surfaces
/// lie too far apart, or another place fits nearly as well.
Result<PassJoin> join_passes(const TriangleMesh& first, const TriangleMesh& second,
                             const PassJoinOptions& options = {}, const Progress& progress = {});

}  // namespace skullstation
