#include "reconstruction/photogrammetry/source_views.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace skullstation {

namespace {

struct Candidate {
  int view = 0;
  double merit = 0.0;
  Eigen::Vector3d side = Eigen::Vector3d::Zero();  ///< unit, from the reference to this centre
};

/// 1 at the best angle; falls faster towards small angles (no depth) than towards large ones
/// (other looks of the surface).
double merit_of_angle(double angle_deg, const SourceViewOptions& options) {
  const double sd = angle_deg < options.best_angle_deg ? 5.0 : 14.0;
  const double off = (angle_deg - options.best_angle_deg) / sd;
  return std::exp(-0.5 * off * off);
}

}  // namespace

std::vector<std::vector<int>> choose_source_views(std::span<const StereoView> views,
                                                  const Eigen::Vector3d& specimen_middle_mm,
                                                  const SourceViewOptions& options) {
  std::vector<std::vector<int>> chosen(views.size());
  for (std::size_t reference = 0; reference < views.size(); ++reference) {
    const Eigen::Vector3d here = views[reference].centre_mm();
    const Eigen::Vector3d sight = (here - specimen_middle_mm).normalized();
    std::vector<Candidate> candidates;
    for (std::size_t other = 0; other < views.size(); ++other) {
      if (other == reference || views[other].pass != views[reference].pass) continue;
      const Eigen::Vector3d there = views[other].centre_mm();
      const Eigen::Vector3d other_sight = (there - specimen_middle_mm).normalized();
      const double angle_deg = degrees(std::acos(std::clamp(sight.dot(other_sight), -1.0, 1.0)));
      if (angle_deg < options.least_angle_deg || angle_deg > options.most_angle_deg) continue;
      candidates.push_back({static_cast<int>(other), merit_of_angle(angle_deg, options),
                            (there - here).normalized()});
    }
    while (!candidates.empty() &&
           chosen[reference].size() < static_cast<std::size_t>(options.count)) {
      const auto best = std::max_element(
          candidates.begin(), candidates.end(),
          [](const Candidate& a, const Candidate& b) { return a.merit < b.merit; });
      const Candidate taken = *best;
      chosen[reference].push_back(taken.view);
      candidates.erase(best);
      // A second one from the same side adds less than one from elsewhere.
      for (Candidate& candidate : candidates) {
        if (candidate.side.dot(taken.side) > std::cos(radians(30.0))) candidate.merit *= 0.6;
      }
    }
  }
  return chosen;
}

}  // namespace skullstation
