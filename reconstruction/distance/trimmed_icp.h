#pragma once

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

struct TrimmedIcpOptions {
  bool estimate_scale = false;
  /// Share of the closest correspondences that take part at first (Chetverikov et al. 2002); at
  /// last it is those within five median distances.
  double kept_share = 0.9;
  int samples = 4000;          ///< taken from either surface
  int max_iterations = 100;    ///< of either stage
  double tolerance_mm = 1e-5;  ///< done when no sample moves farther
  int threads = 0;             ///< 0: all

  Result<void> validate() const;
};

struct TrimmedIcpResult {
  Similarity3 b_from_a;      ///< x_b = scale * R x_a + t; scale 1 unless estimated
  double kept_rms_mm = 0.0;  ///< point to plane, over the correspondences kept in the end
  int iterations = 0;
  bool converged = false;
};

/// Aligns surface A with surface B, which must lie near each other already: within some
/// centimetres and 30 degrees for heads. Point-to-plane steps (Chen & Medioni 1992; 7 unknowns
/// with the scale) on closest points both ways, so that no surface gains by shrinking. Starts from
/// the identity and, for the similarity, also from equal centroids and RMS radii; the better end
/// counts. Deterministic for any number of threads. Fails with `no_result` where the surfaces
/// don't determine the transform, `cancelled` on request.
Result<TrimmedIcpResult> align_by_trimmed_icp(const TriangleMesh& a, const TriangleMesh& b,
                                              const TrimmedIcpOptions& options,
                                              const Progress& progress = {});

}  // namespace skullstation
