#include <algorithm>
#include <cmath>
#include <set>

#include "core/units.h"
#include "reconstruction/photogrammetry/poses_sfm.h"

namespace skullstation {

namespace {

/// Number of all pairs, times the mean size of a view.
double pair_megapixels(std::span<const PoseObservation> views,
                       std::span<const PoseCamera> cameras) {
  double megapixels = 0.0;
  for (const PoseObservation& view : views) {
    const PoseCamera& camera = cameras[static_cast<std::size_t>(view.camera)];
    megapixels += 1e-6 * camera.width * camera.height;
  }
  return 0.5 * (static_cast<double>(views.size()) - 1.0) * megapixels;
}

class Pairs {
 public:
  void add(std::size_t a, std::size_t b) {
    if (a != b) pairs_.insert({static_cast<int>(std::min(a, b)), static_cast<int>(std::max(a, b))});
  }
  std::vector<std::pair<int, int>> list() const { return {pairs_.begin(), pairs_.end()}; }

 private:
  std::set<std::pair<int, int>> pairs_;
};

void pair_by_angle(std::span<const PoseObservation> views, Pairs& pairs) {
  constexpr double reach_on_ring_deg = 32.0;
  constexpr double reach_between_rings_deg = 16.0;
  constexpr std::size_t least_neighbours = 2;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<std::pair<double, std::size_t>> others;
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (j == i) continue;
      const double apart_deg =
          std::abs(turn_deg(*views[i].table_angle_deg, *views[j].table_angle_deg));
      const bool one_ring = views[i].camera == views[j].camera;
      if (apart_deg <= (one_ring ? reach_on_ring_deg : reach_between_rings_deg)) pairs.add(i, j);
      if (one_ring) others.emplace_back(apart_deg, j);
    }
    std::ranges::sort(others);
    for (std::size_t k = 0; k < std::min(least_neighbours, others.size()); ++k) {
      pairs.add(i, others[k].second);
    }
  }
}

void pair_by_time(std::size_t count, Pairs& pairs) {
  constexpr std::size_t reach = 6;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t step = 1; step <= reach; ++step) pairs.add(i, (i + step) % count);
    for (std::size_t step = 8; step < count; step *= 2) pairs.add(i, (i + step) % count);
  }
}

}  // namespace

std::vector<std::pair<int, int>> pairs_to_match(std::span<const PoseObservation> views,
                                                std::span<const PoseCamera> cameras) {
  // Small pictures have few features, so that their pairs are quickly matched.
  constexpr double most_pair_megapixels = 600.0;
  Pairs pairs;
  const bool angles_known = std::ranges::all_of(
      views, [](const PoseObservation& view) { return view.table_angle_deg.has_value(); });
  if (angles_known) {
    pair_by_angle(views, pairs);
  } else if (pair_megapixels(views, cameras) <= most_pair_megapixels) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      for (std::size_t j = i + 1; j < views.size(); ++j) pairs.add(i, j);
    }
  } else {
    pair_by_time(views.size(), pairs);
  }
  return pairs.list();
}

}  // namespace skullstation
