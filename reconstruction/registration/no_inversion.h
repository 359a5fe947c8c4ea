#pragma once

#include "reconstruction/registration/skull_template.h"

namespace skullstation {

struct SafeStep {
  Points3 vertices;          ///< #V x 3
  int held_vertices = 0;     ///< that did not go the whole way
  double least_share = 0.0;  ///< least volume in units of the rest volume
};

/// The vertices moved from `from` towards `to` (#V x 3) so far that no tetrahedron falls below
/// `least_share` of its rest volume: where one would, the vertices about it go a shorter way, with
/// a passage around them; in the end they stay. \pre all of `from` is above
SafeStep step_without_inversion(const Tetrahedra& tetrahedra, const Eigen::VectorXd& rest_volumes,
                                const Points3& from, const Points3& to, double least_share);

}  // namespace skullstation
