#include "reconstruction/photogrammetry/sfm_rings.h"

#include <algorithm>

#include "core/median.h"
#include "reconstruction/photogrammetry/sfm_frame.h"

namespace skullstation {

namespace {

constexpr double reach_mm = 120.0;

/// Adds the model's points to the problem, with all their sights in its views, and the sights'
/// noise. Returns the points' indices in the model.
std::vector<std::size_t> add_points(const SfmModel& model, const Similarity3& frame_from_model,
                                    SfmRings& rings) {
  BundleProblem& problem = rings.problem;
  std::vector<BundleView*> view_of_image(model.camera_from_model.size(), nullptr);
  for (std::size_t k = 0; k < rings.images.size(); ++k) {
    view_of_image[rings.images[k]] = &problem.views[k];
  }
  std::vector<std::size_t> of_model;
  std::vector<double> errors_px;
  for (std::size_t p = 0; p < model.points.size(); ++p) {
    const SfmPoint& point = model.points[p];
    const auto view_of = [&](const SfmPoint::Sight& sight) {
      return view_of_image[static_cast<std::size_t>(sight.image)];
    };
    const auto in_views = [&](const SfmPoint::Sight& sight) { return view_of(sight) != nullptr; };
    if (std::ranges::count_if(point.sights, in_views) < 2) continue;
    const Eigen::Vector3d x = frame_from_model * point.x_model;
    for (const SfmPoint::Sight& sight : point.sights) {
      BundleView* const view = view_of(sight);
      if (view == nullptr) continue;
      view->sights.push_back({static_cast<int>(problem.points.size()), sight.position_px});
      const Lens& lens = model.lenses[static_cast<std::size_t>(view->lens)];
      errors_px.push_back((lens.project(view->camera_from_board * x) - sight.position_px).norm());
    }
    problem.points.push_back(x);
    of_model.push_back(p);
  }
  // The distance in two coordinates of one standard deviation has its median at 1.18 of it.
  constexpr double least_sd_px = 0.05;
  problem.sight_sd_px = std::max(least_sd_px, median(std::move(errors_px)) / 1.1774);
  return of_model;
}

/// One adjustment, after which the model is in the frame; false: nothing has changed.
bool adjust_once(SfmModel& model, Similarity3& frame_from_model, SfmRings& rings) {
  BundleProblem& problem = rings.problem;
  for (const Lens& lens : model.lenses) problem.lenses.push_back({lens, lens});
  const std::vector<std::size_t> of_model = add_points(model, frame_from_model, rings);
  const auto covariances = covariance_by_points(problem, reach_mm);
  if (covariances.empty()) return false;
  constexpr double least_departure_mm = 0.02;
  const TableTrust trust = trust_in_rings(problem, covariances, reach_mm, least_departure_mm);
  if (!adjust_views_by_points(problem, trust)) return false;
  for (auto& camera : model.camera_from_model) {
    if (camera) camera = in_reference(*camera, frame_from_model);
  }
  for (std::size_t k = 0; k < rings.images.size(); ++k) {
    model.camera_from_model[rings.images[k]] = problem.views[k].camera_from_board;
  }
  for (SfmPoint& point : model.points) point.x_model = frame_from_model * point.x_model;
  for (std::size_t p = 0; p < of_model.size(); ++p) {
    model.points[of_model[p]].x_model = problem.points[p];
  }
  frame_from_model = {};
  return true;
}

/// What is far from where its point is now seen was a wrong match.
void drop_far_sights(SfmModel& model, const RingMembers& members) {
  constexpr double limit_px = 3.0;
  for (SfmPoint& point : model.points) {
    std::erase_if(point.sights, [&](const SfmPoint::Sight& sight) {
      const auto i = static_cast<std::size_t>(sight.image);
      if (!members[i] || !model.camera_from_model[i]) return false;
      const Lens& lens = model.lenses[static_cast<std::size_t>(members[i]->camera)];
      const Eigen::Vector3d x = *model.camera_from_model[i] * point.x_model;
      return x.z() <= 0.0 || (lens.project(x) - sight.position_px).norm() > limit_px;
    });
  }
  std::erase_if(model.points, [](const SfmPoint& point) { return point.sights.size() < 2; });
}

}  // namespace

std::optional<SfmRings> find_sfm_rings(const SfmModel& model, const Similarity3& frame_from_model,
                                       const RingMembers& members) {
  SfmRings rings;
  std::vector<RingMembership> of_views;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (!members[i] || !members[i]->table_angle_deg || !model.camera_from_model[i]) continue;
    BundleView& added = rings.problem.views.emplace_back();
    added.lens = members[i]->camera;
    added.camera_from_board = in_reference(*model.camera_from_model[i], frame_from_model);
    of_views.push_back(*members[i]);
    rings.images.push_back(i);
  }
  constexpr double loss_mm = 1.0;
  if (begin_rings(rings.problem, of_views).empty() ||
      !adjust_rings(rings.problem, reach_mm, loss_mm)) {
    return std::nullopt;
  }
  level_rings(rings.problem);
  for (const BundleView& view : rings.problem.views) {
    rings.departures_mm.push_back(view.ring < 0 ? 0.0
                                                : ring_departure_mm(rings.problem, view, reach_mm));
  }
  return rings;
}

void adjust_to_rings(SfmModel& model, Similarity3& frame_from_model, const RingMembers& members) {
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    std::optional<SfmRings> rings = find_sfm_rings(model, frame_from_model, members);
    if (!rings || !adjust_once(model, frame_from_model, *rings)) return;
    drop_far_sights(model, members);
  }
}

}  // namespace skullstation
