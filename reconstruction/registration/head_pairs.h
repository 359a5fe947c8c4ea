#pragma once

#include <vector>

#include "reconstruction/registration/head_fit_quality.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/surface_point.h"

namespace skullstation {

/// What pulls a place of the template where.
struct HeadPair {
  SurfacePoint place;
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< in the input
  double weight = 0.0;                               ///< in [0, 1]; 0: no correspondence
};

/// Pairs farther apart, or with normals that differ more, do not count.
struct HeadPairLimits {
  double distance_mm = 4.0;
  double normal_deg = 40.0;
};

/// From the input's points to the template's vertices nearest in place and direction
/// (OrientedPointTree): the tip of a long nose finds the template's, not its flank. `rim`: which
/// vertices are on the sheet's end, where nothing holds. Not the other way, too: where a scan ends,
/// its edge would draw what lies beyond it.
std::vector<HeadPair> alike_pairs(const HeadTemplate& head, const Points3& vertices,
                                  const std::vector<bool>& rim, const ScanPoints& scan,
                                  const HeadPairLimits& limits, int threads);

/// From the input's points to the nearest of the template. A target lies across the input's
/// surface from there, and `tangential_share` of the way along it.
std::vector<HeadPair> nearest_pairs(const HeadTemplate& head, const Points3& vertices,
                                    const std::vector<bool>& rim, const ScanPoints& scan,
                                    const HeadPairLimits& limits, double tangential_share,
                                    int threads);

struct HeadPairDistances {
  int count = 0;
  double rms_mm = 0.0;
};

/// Pairs farther apart than most count less (Welsch, scale from the median).
HeadPairDistances weigh(std::vector<HeadPair>& pairs, const Points3& vertices);

}  // namespace skullstation
