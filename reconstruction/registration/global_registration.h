#pragma once

#include <cstdint>

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

enum class ScaleKnowledge {
  same_unit,  ///< both in mm: the scale is 1
  unknown     ///< the source's unit is unknown, or its size is
};

struct GlobalRegistrationOptions {
  ScaleKnowledge scale = ScaleKnowledge::same_unit;
  int feature_points = 4000;  ///< of either surface, for features
  int fit_points = 1500;      ///< of the source, to judge a hypothesis
  int hypotheses = 12;        ///< that are followed to their end
  /// Least share of the source that must lie on the target in the end.
  double least_overlap = 0.5;
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

struct GlobalRegistration {
  Similarity3 target_from_source;
  double overlap = 0.0;  ///< share of the source's points that lie on the target
  double rms_mm = 0.0;   ///< point to plane, over those
  /// Cost of the best hypothesis that ends elsewhere (more than 15 deg or a tenth of the target's
  /// size away), in units of the winner's: near 1 means ambiguous; 0: there is no other.
  double runner_up = 0.0;
};

/// Where the source lies on the target, from any pose, without a start; the source may be a part of
/// the target. Hypotheses from feature matches (FPFH) that agree in threes, and from half turns
/// about the principal axes, since skulls are nearly symmetric; each is refined by graduated
/// non-convexity over the matches (Zhou et al. 2016) and by ICP, and judged by the truncated
/// distances of all points, not of the matches. Never a reflection. The same for any number of
/// threads. Fails with `bad_input` for meshes without area, `no_result` where less than
/// `least_overlap` fits, `cancelled` on request.
Result<GlobalRegistration> register_globally(const TriangleMesh& source, const TriangleMesh& target,
                                             const GlobalRegistrationOptions& options = {},
                                             const Progress& progress = {});

}  // namespace skullstation
