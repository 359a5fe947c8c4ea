#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// How much of the truth the surface comes near to.
struct SlantMeasures {
  double most_slant_deg = 0.0;
  double seen_cm2 = 0.0;
  double within_half_mm_percent = 0.0;
};

/// A reconstructed surface against the true one, as in the table of PHOTOGRAMMETRY's peers.
struct SurfaceMeasures {
  double area_cm2 = 0.0;
  double mean_mm = 0.0;  ///< of the distances of the whole surface from the truth, by area
  double median_mm = 0.0;
  double p95_mm = 0.0;
  double above_1mm_percent = 0.0;
  double seen_cm2 = 0.0;                ///< of the truth: seen by 3 or more views
  double within_half_mm_percent = 0.0;  ///< of that
  double within_1mm_percent = 0.0;
  /// The same by how aslant the third best of the views sees it: below 45, 60, 70, 78, 84 deg.
  std::array<SlantMeasures, 5> by_slant{};
};

/// Seen: less than 84 deg off the normal and nothing of the specimen before it.
Result<SurfaceMeasures> measure_surface(const TriangleMesh& surface, const TriangleMesh& truth,
                                        std::span<const StereoView> views, int threads);

/// Distances of places of the truth from a surface.
struct GapMeasures {
  double mean_mm = 0.0;
  double median_mm = 0.0;
  double p95_mm = 0.0;
};

/// Surfaces compared on the part of the truth that none of them misses by 2 mm or more: each one's
/// own error is over what it holds, and the worse one may hold less.
struct CommonMeasures {
  double area_cm2 = 0.0;          ///< of the truth: what all hold
  std::vector<GapMeasures> gaps;  ///< one for each surface
};

/// Looks at the truth at half a place per square millimetre.
Result<CommonMeasures> measure_what_all_hold(std::span<const TriangleMesh> surfaces,
                                             const TriangleMesh& truth, int threads);

/// A fifth of a surface's vertices.
struct EstimatedAccuracy {
  double estimate_mm = 0.0;           ///< median of the stated standard errors
  double error_mm = 0.0;              ///< 1.4826 times the median distance from the truth
  double within_twice_percent = 0.0;  ///< lie less than two stated standard errors off the truth
};

/// Does a vertex's stated accuracy tell how far off it is? By the statement, the best fifth first;
/// vertices without one (0) are left out.
std::array<EstimatedAccuracy, 5> check_estimates(const TriangleMesh& surface,
                                                 std::span<const float> accuracy_mm,
                                                 const TriangleMesh& truth, int threads);

}  // namespace skullstation
