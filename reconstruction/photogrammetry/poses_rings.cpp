#include "reconstruction/photogrammetry/poses_rings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/median.h"
#include "core/units.h"

namespace skullstation {

namespace {

using Members = std::vector<std::size_t>;  // indices of views

/// The axis that the board, as its cameras saw it, turns about.
std::optional<TableAxis> common_axis(const BundleProblem& problem,
                                     const std::vector<Members>& rings) {
  constexpr double least_turn_deg = 5.0;
  std::vector<Rigid3> motions;
  for (const Members& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      // Each view against the one half a list away: large turns tell the axis best.
      const std::size_t j = (i + ring.size() / 2) % ring.size();
      motions.push_back(problem.views[ring[i]].camera_from_board.inverse() *
                        problem.views[ring[j]].camera_from_board);
    }
  }
  return axis_of_motions(motions, least_turn_deg);
}

/// Turn of the table from one view of a ring to another, as the board shows it.
double measured_turn_deg(const BundleProblem& problem, const Rigid3& table_from_board,
                         std::size_t from, std::size_t to) {
  const Rigid3 board_from_table = table_from_board.inverse();
  const Eigen::Quaterniond turn =
      ((problem.views[from].camera_from_board * board_from_table).inverse() *
       (problem.views[to].camera_from_board * board_from_table))
          .rotation;
  return degrees(2.0 * std::atan2(turn.z(), turn.w()));
}

/// Displacement of the reach points that the errors of a view's pose stand for [mm].
double pose_noise_mm(const BundleView& view, const Eigen::Matrix<double, 6, 6>& covariance,
                     double reach_mm) {
  double variance = 0.0;
  for (const Eigen::Vector3d& point : reach_points(reach_mm)) {
    const Eigen::Vector3d x = view.camera_from_board.rotation * point;
    Eigen::Matrix<double, 3, 6> by_motion;
    by_motion << 0.0, x.z(), -x.y(), 1.0, 0.0, 0.0,  //
        -x.z(), 0.0, x.x(), 0.0, 1.0, 0.0,           //
        x.y(), -x.x(), 0.0, 0.0, 0.0, 1.0;
    variance += (by_motion * covariance * by_motion.transpose()).trace() / 4.0;
  }
  return std::sqrt(variance);
}

}  // namespace

std::vector<int> begin_rings(BundleProblem& problem, const std::vector<RingMembership>& members) {
  std::map<int, std::map<int, Members>> passes;  // pass, camera: views in the order of time
  for (std::size_t i = 0; i < members.size(); ++i) {
    problem.views[i].ring = -1;
    if (members[i].table_angle_deg) passes[members[i].pass][members[i].camera].push_back(i);
  }
  problem.axes.clear();
  problem.rings.clear();
  std::vector<int> pass_of_axis;
  for (const auto& [pass, cameras] : passes) {
    std::vector<Members> rings;
    for (const auto& [camera, ring] : cameras) {
      if (ring.size() >= 3) rings.push_back(ring);
    }
    const auto axis = common_axis(problem, rings);
    if (!axis) continue;
    const Rigid3 table_from_board = axis->table_from_board();
    double as_told_deg = 0.0;
    double other_way_deg = 0.0;
    for (const Members& ring : rings) {
      for (std::size_t i = 1; i < ring.size(); ++i) {
        const double turn = measured_turn_deg(problem, table_from_board, ring[i - 1], ring[i]);
        const double told =
            *members[ring[i]].table_angle_deg - *members[ring[i - 1]].table_angle_deg;
        as_told_deg += std::abs(turn_deg(told, turn));
        other_way_deg += std::abs(turn_deg(-told, turn));
      }
    }
    const double sign = other_way_deg < as_told_deg ? -1.0 : 1.0;
    for (const Members& ring : rings) {
      BundleRing& added = problem.rings.emplace_back();
      added.axis = static_cast<int>(problem.axes.size());
      const double first_deg = sign * *members[ring.front()].table_angle_deg;
      added.camera_from_station = problem.views[ring.front()].camera_from_board *
                                  table_from_board.inverse() * rotation_about_z(-first_deg);
      for (const std::size_t i : ring) {
        BundleView& view = problem.views[i];
        const double commanded_deg = sign * *members[i].table_angle_deg;
        const double measured_deg =
            first_deg + measured_turn_deg(problem, table_from_board, ring.front(), i);
        view.ring = static_cast<int>(problem.rings.size()) - 1;
        view.commanded_rad = radians(commanded_deg);
        view.angle_rad = radians(commanded_deg + turn_deg(commanded_deg, measured_deg));
      }
    }
    problem.axes.push_back(*axis);
    pass_of_axis.push_back(pass);
  }
  return pass_of_axis;
}

void level_rings(BundleProblem& problem) {
  for (std::size_t r = 0; r < problem.rings.size(); ++r) {
    std::vector<double> errors_rad;
    for (const BundleView& view : problem.views) {
      if (std::cmp_equal(view.ring, r)) errors_rad.push_back(view.angle_rad - view.commanded_rad);
    }
    if (errors_rad.empty()) continue;
    const auto middle = errors_rad.begin() + static_cast<std::ptrdiff_t>(errors_rad.size() / 2);
    std::nth_element(errors_rad.begin(), middle, errors_rad.end());
    const double zero_rad = *middle;
    BundleRing& ring = problem.rings[r];
    ring.camera_from_station = ring.camera_from_station * rotation_about_z(degrees(zero_rad));
    for (BundleView& view : problem.views) {
      if (std::cmp_equal(view.ring, r)) view.angle_rad -= zero_rad;
    }
  }
}

TableTrust trust_in_rings(const BundleProblem& problem,
                          const std::vector<Eigen::Matrix<double, 6, 6>>& covariances,
                          double reach_mm, double least_departure_mm) {
  constexpr double least_angle_sd_deg = 0.02;
  std::vector<double> departures;
  std::vector<double> noise;
  std::vector<double> angles_deg;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const BundleView& view = problem.views[i];
    if (view.ring < 0) continue;
    departures.push_back(ring_departure_mm(problem, view, reach_mm));
    noise.push_back(pose_noise_mm(view, covariances[i], reach_mm));
    angles_deg.push_back(std::abs(degrees(view.angle_rad - view.commanded_rad)));
  }
  const double measured = median(std::move(departures));
  const double by_noise = median(std::move(noise));
  TableTrust trust;
  trust.reach_mm = reach_mm;
  trust.departure_mm = std::sqrt(
      std::max(least_departure_mm * least_departure_mm, measured * measured - by_noise * by_noise));
  trust.angle_sd_deg = std::max(least_angle_sd_deg, 1.4826 * median(std::move(angles_deg)));
  return trust;
}

}  // namespace skullstation
