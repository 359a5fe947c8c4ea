#include "reconstruction/registration/no_inversion.h"

#include <algorithm>
#include <vector>

namespace skullstation {

SafeStep step_without_inversion(const Tetrahedra& tetrahedra, const Eigen::VectorXd& rest_volumes,
                                const Points3& from, const Points3& to, double least_share) {
  Eigen::VectorXd share = Eigen::VectorXd::Ones(from.rows());
  SafeStep step;
  step.vertices = to;
  // Halving ten times, then staying: ends with `from` where all else fails.
  constexpr int kHalvings = 10;
  for (int round = 0;; ++round) {
    const Eigen::VectorXd volumes = signed_volumes(tetrahedra, step.vertices);
    std::vector<char> near(static_cast<std::size_t>(from.rows()), 0);
    bool any = false;
    for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
      if (volumes[t] >= least_share * rest_volumes[t]) continue;
      any = true;
      for (int i = 0; i < 4; ++i) near[static_cast<std::size_t>(tetrahedra(t, i))] = 1;
    }
    if (!any) {
      step.least_share = (volumes.array() / rest_volumes.array()).minCoeff();
      break;
    }
    // The neighbours come along every other round: a held vertex must not stand alone.
    std::vector<char> wide = near;
    if (round % 2 == 1) {
      for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
        bool touches = false;
        for (int i = 0; i < 4; ++i) {
          touches = touches || near[static_cast<std::size_t>(tetrahedra(t, i))] != 0;
        }
        if (!touches) continue;
        for (int i = 0; i < 4; ++i) wide[static_cast<std::size_t>(tetrahedra(t, i))] = 1;
      }
    }
    for (Eigen::Index v = 0; v < from.rows(); ++v) {
      if (wide[static_cast<std::size_t>(v)] == 0) continue;
      share[v] = round < kHalvings ? 0.5 * share[v] : 0.0;
      step.vertices.row(v) = from.row(v) + share[v] * (to.row(v) - from.row(v));
    }
  }
  step.held_vertices = static_cast<int>((share.array() < 1.0).count());
  return step;
}

}  // namespace skullstation
