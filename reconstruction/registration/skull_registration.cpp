#include "reconstruction/registration/skull_registration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "reconstruction/registration/curvature_measure.h"
#include "reconstruction/registration/deformation_solver.h"
#include "reconstruction/registration/input_check.h"
#include "reconstruction/registration/input_surface.h"
#include "reconstruction/registration/no_inversion.h"
#include "reconstruction/registration/part_alignment.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/registration/skull_fit_quality.h"
#include "reconstruction/registration/skull_pairs.h"
#include "reconstruction/registration/surface_pose.h"
#include "reconstruction/registration/volume_energy.h"

namespace skullstation {

namespace {

enum class Search { far, ridges, alike_and_ridges, alike, two_way };

/// A stretch of iterations at one stiffness.
struct Level {
  const char* name;
  double smooth_mm4;
  double volume;  ///< weight of the volume term, where it is chosen
  PairLimits limits;
  double inner_weight;
  Search search;
  int iterations;
};

/// Stiff to soft. Its fourth root is about the length over which a displacement may turn.
constexpr Level kLevels[] = {
    {"far", 1e6, 1.0, {20.0, 45.0, 8.0}, 0.0, Search::far, 3},
    {"far, soft", 1e5, 1.0, {15.0, 45.0, 6.0}, 0.0, Search::far, 6},
    {"curvature", 1e5, 1.0, {8.0, 45.0}, 0.0, Search::ridges, 3},
    {"alike, stiff", 1e5, 1.0, {6.0, 40.0}, 0.0, Search::alike_and_ridges, 6},
    {"alike", 1e4, 1.0, {5.0, 40.0}, 0.0, Search::alike_and_ridges, 6},
    {"alike, soft", 1e3, 1.0, {4.0, 35.0}, 0.0, Search::alike_and_ridges, 4},
    {"alike, softer", 1e2, 1.0, {3.0, 35.0}, 0.0, Search::alike, 3},
    {"fine", 1e1, 0.1, {2.0, 30.0}, 0.05, Search::two_way, 3},
};
/// Of the cranium alone, before the mandible is looked for.
constexpr Level kCraniumLevels[] = {
    {"cranium, far", 1e6, 1.0, {20.0, 45.0, 8.0}, 0.0, Search::far, 2},
    {"cranium, far, soft", 1e5, 1.0, {15.0, 45.0, 6.0}, 0.0, Search::far, 3},
};
constexpr double kPartsSmooth_mm4 = 1e6;
constexpr PairLimits kPartLimits{5.0, 45.0};
constexpr double kRidgeShare = 0.3;
constexpr double kRidgeRadius_mm = 6.0;
constexpr double kSampleSpacing_mm = 2.0;
/// Keeps what nothing else holds (a bone that is missing) where it is.
constexpr double kHold = 1e-4;
/// How much a correspondence that may slide holds along the surface, relative to across.
constexpr double kTangentialShare = 0.02;
/// No tetrahedron may keep less of its rest volume.
constexpr double kLeastVolumeShare = 0.05;
/// Of the paper's volume term, relative to a level's smoothness: chosen for the best fit on
/// phantoms, see docs/registration.md.
constexpr double kVolumePerSmooth = 1e-9;

/// A registration under way, in the template's frame.
class Fit {
 public:
  /// `size`: what the template is scaled by at first.
  Fit(const SkullTemplate& skull, double size, const InputSurface& input,
      const SkullRegistrationOptions& options)
      : skull_(skull),
        input_(input),
        options_(options),
        solver_(skull),
        rest_volumes_(signed_volumes(skull.tetrahedra, skull.vertices)),
        area_share_(area_shares(skull)),
        state_(state_of(skull, size * skull.vertices)) {
    const OrientedPoints points{state_.surface.vertices, state_.surface.normals};
    const Eigen::VectorXd bend =
        curvature_measure(points, PointTree(points.positions), kRidgeRadius_mm, options.threads);
    const double least = upper_quantile(bend, kRidgeShare);
    ridge_.resize(static_cast<std::size_t>(skull.boundary_count));
    for (int v = 0; v < skull.boundary_count; ++v) {
      ridge_[static_cast<std::size_t>(v)] = bend[v] >= least;
    }
  }

  /// Hierarchical ICP, then the whole template after its parts. The cranium is bent by itself
  /// before the mandible is looked for, and begins anew with it.
  void follow_parts() {
    const TriangleMesh surface = state_.surface;
    const Points3 unplaced = state_.vertices;
    begin_stage();
    PartAlignment parts = align_cranium(skull_, surface, input_);
    place(unplaced, parts);
    end_stage("cranium", 1, {}, 0.0);
    for (const Level& level : kCraniumLevels) run(level);

    begin_stage();
    find_mandible(skull_, surface, state_.surface.vertices, input_, parts);
    align_regions(skull_, surface, input_, options_.threads, parts);
    place(unplaced, parts);
    mandible_found_ = parts.mandible_found;
    const SkullPairs pairs = part_pairs(state_, parts, input_, kPartLimits, options_.threads);
    const double move = deform(rest_, pairs, kPartsSmooth_mm4, 1.0, true);
    end_stage("parts", 1, pairs, move);
  }

  void run(const Level& level) {
    begin_stage();
    // The smoothness of the whole displacement counts; the volume terms count from level to level.
    Points3 before = options_.regularizer == SkullRegularizer::smooth ? rest_ : state_.vertices;
    SkullPairs pairs;
    double move = 0.0;
    int iteration = 0;
    while (iteration < level.iterations) {
      pairs = pairs_of(level);
      move = deform(before, pairs, level.smooth_mm4, level.volume, iteration == 0);
      ++iteration;
      // What lies far off flows there; bending back from there would cost as much as the way.
      if (level.search == Search::far) before = rest_ = state_.vertices;
      if (move < 0.01) break;
    }
    end_stage(level.name, iteration, pairs, move);
  }

  /// The undeformed template goes where points of interest went, and only these; what was drawn out
  /// of shape between them is let go (the paper's release step).
  void release() {
    begin_stage();
    const Points3 reached = state_.vertices;
    Points3 rest(skull_.vertices.rows(), 3);
    for (const SkullBone bone : {SkullBone::cranium, SkullBone::mandible}) {
      Points3 from(skull_.vertices.rows(), 3);
      Points3 to(skull_.vertices.rows(), 3);
      Eigen::Index count = 0;
      for (int v = 0; v < skull_.boundary_count; ++v) {
        if (bone_of(skull_.region[static_cast<std::size_t>(v)]) != bone) continue;
        from.row(count) = skull_.vertices.row(v);
        to.row(count++) = reached.row(v);
      }
      from.conservativeResize(count, 3);
      to.conservativeResize(count, 3);
      const auto placed = fit_similarity(from, to, {}, FitScale::to_target);
      const Similarity3 transform = placed.value_or(Similarity3{});
      for (Eigen::Index v = 0; v < rest.rows(); ++v) {
        if (bone_of(skull_.region[static_cast<std::size_t>(v)]) != bone) continue;
        rest.row(v) = (transform * skull_.vertices.row(v).transpose()).transpose();
      }
    }
    SkullPairs pairs{Eigen::VectorXd::Zero(skull_.boundary_count),
                     reached.topRows(skull_.boundary_count),
                     state_.surface.normals,
                     std::vector<bool>(static_cast<std::size_t>(skull_.boundary_count), true),
                     0,
                     0.0};
    for (int v = 0; v < skull_.boundary_count; ++v) {
      const auto at = static_cast<std::size_t>(v);
      if (!skull_.outer[at] || !ridge_[at]) continue;
      pairs.weight[v] = 1.0;
      ++pairs.count;
    }
    state_ = state_of(skull_, rest);
    rest_ = rest;
    const double move = deform(rest, pairs, 1e4, 1.0, true);
    end_stage("release", 1, pairs, move);
  }

  double least_volume_share() const {
    return (signed_volumes(skull_.tetrahedra, state_.vertices).array() / rest_volumes_.array())
        .minCoeff();
  }

  const SkullState& state() const { return state_; }
  FitStages take_stages() { return std::move(stages_); }

 private:
  /// Both bones of the template where their parts went.
  void place(const Points3& vertices, const PartAlignment& parts) {
    Points3 placed(vertices.rows(), 3);
    for (Eigen::Index v = 0; v < placed.rows(); ++v) {
      const auto bone =
          static_cast<std::size_t>(bone_of(skull_.region[static_cast<std::size_t>(v)]));
      placed.row(v) = (parts.bones[bone] * vertices.row(v).transpose()).transpose();
    }
    state_ = state_of(skull_, std::move(placed));
    rest_ = state_.vertices;
  }

  SkullPairs pairs_of(const Level& level) const {
    const int threads = options_.threads;
    if (level.search == Search::two_way) {
      return two_way_pairs(state_, input_, level.limits, level.inner_weight, threads);
    }
    if (level.search == Search::ridges) {
      return ridge_pairs(state_, ridge_, input_, level.limits, threads);
    }
    const bool far = level.search == Search::far;
    SkullPairs pairs = alike_pairs(state_, input_, level.limits, far, threads);
    if (level.search == Search::alike_and_ridges) {
      put_over(pairs, ridge_pairs(state_, ridge_, input_, level.limits, threads));
    }
    if (far && !mandible_found_) {
      // What a missing bone would find far away is another.
      for (int v = 0; v < skull_.boundary_count; ++v) {
        const bool lower =
            bone_of(skull_.region[static_cast<std::size_t>(v)]) == SkullBone::mandible;
        if (lower) pairs.weight[v] = 0.0;
      }
    }
    return pairs;
  }

  static Eigen::VectorXd area_shares(const SkullTemplate& skull) {
    const Eigen::VectorXd area = vertex_areas(surface_of(skull, skull.vertices));
    double outer = 0.0;
    for (int v = 0; v < skull.boundary_count; ++v) {
      if (skull.outer[static_cast<std::size_t>(v)]) outer += area[v];
    }
    return area / outer;
  }

  /// Moves the state towards the pairs, its shape measured from `before`; the mean move [mm].
  double deform(const Points3& before, const SkullPairs& pairs, double smooth_mm4, double volume,
                bool new_level) {
    const Eigen::Index count = skull_.vertices.rows();
    DeformationTargets targets{Eigen::VectorXd::Constant(count, kHold / static_cast<double>(count)),
                               Points3::Zero(count, 3), Points3::Zero(count, 3), kTangentialShare};
    // The factor takes one number for all directions.
    Eigen::VectorXd mean_weight = targets.weight;
    for (int v = 0; v < skull_.boundary_count; ++v) {
      const double weight = area_share_[v] * pairs.weight[v];
      if (weight <= 0.0) continue;
      targets.displacement.row(v) = pairs.target.row(v) - before.row(v);
      targets.weight[v] += weight;
      const bool anchored = pairs.anchored[static_cast<std::size_t>(v)];
      if (!anchored) targets.normal.row(v) = pairs.normal.row(v);
      mean_weight[v] += weight * (anchored ? 1.0 : (1.0 + 2.0 * kTangentialShare) / 3.0);
    }
    const Points3 start = state_.vertices - before;
    Points3 displacement;
    if (options_.regularizer == SkullRegularizer::volume) {
      displacement =
          solve_volume_energy(skull_.tetrahedra, before, targets.weight, targets.displacement,
                              kVolumePerSmooth * smooth_mm4, start);
    } else {
      const bool projected = options_.regularizer == SkullRegularizer::projected_volume;
      if (new_level) {
        solver_.stiffen(projected ? 0.0 : smooth_mm4, projected ? volume : 0.0, mean_weight);
      }
      const Points3 pull = projected
                               ? Points3(volume * volume_projection_pull(skull_.tetrahedra, before,
                                                                         start, options_.threads))
                               : Points3(0, 3);
      displacement = solver_.solve(targets, pull, start);
    }
    const Points3 from = state_.vertices;
    SafeStep step = step_without_inversion(skull_.tetrahedra, rest_volumes_, from,
                                           before + displacement, kLeastVolumeShare);
    state_ = state_of(skull_, std::move(step.vertices));
    return (state_.vertices - from).rowwise().norm().mean();
  }

  void begin_stage() { began_s_ = processor_seconds(); }
  void end_stage(std::string name, int iterations, const SkullPairs& pairs, double move_mm) {
    stages_.push_back({std::move(name), iterations, pairs.count, pairs.rms_mm, move_mm,
                       processor_seconds() - began_s_});
  }

  const SkullTemplate& skull_;
  const InputSurface& input_;
  const SkullRegistrationOptions& options_;
  DeformationSolver solver_;
  Eigen::VectorXd rest_volumes_;
  Eigen::VectorXd area_share_;  ///< of each surface vertex, of the outer surface
  std::vector<bool> ridge_;     ///< surface vertices where the template bends most
  SkullState state_;
  Points3 rest_;                 ///< #V x 3: the bones placed and stretched, not yet bent
  bool mandible_found_ = false;  ///< when the parts were laid on the input
  FitStages stages_;
  double began_s_ = 0.0;
};

}  // namespace

Result<void> SkullRegistrationOptions::validate() const {
  if (threads < 0) return fail(ErrorKind::usage, "threads", "must be 0 or more");
  return {};
}

Result<FittedSkull> register_skull(const SkullTemplate& skull, const TriangleMesh& input,
                                   const SkullRegistrationOptions& options,
                                   const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (const auto valid = check_input(input, "skull", options.unit_unknown); !valid) {
    return forward(valid);
  }
  const auto cancelled = [] { return fail(ErrorKind::cancelled, "skull", "cancelled"); };
  const double began_s = processor_seconds();
  progress.report(0.0, "global pose");
  Similarity3 pose;
  if (options.start != nullptr) {
    pose = *options.start;
  } else {
    const auto found = find_surface_pose(
        surface_of(skull, skull.vertices), input,
        {.unit_unknown = options.unit_unknown, .seed = options.seed, .threads = options.threads});
    if (!found) return forward(found);
    pose = *found;
  }
  // The input keeps its own millimetres, unless nobody knows its unit.
  Similarity3 frame = pose;
  frame.scale = options.unit_unknown ? pose.scale : 1.0;
  const double posed_s = processor_seconds();

  progress.report(0.1, "parts");
  auto surface =
      InputSurface::make(moved(frame.inverse(), input), kSampleSpacing_mm, options.threads);
  if (!surface) return forward(surface);
  Fit fit(skull, pose.scale / frame.scale, *surface, options);
  fit.follow_parts();
  bool released = false;
  for (std::size_t l = 0; l < std::size(kLevels); ++l) {
    if (progress.stop.stop_requested()) return cancelled();
    progress.report(0.3 + 0.6 * static_cast<double>(l) / std::size(kLevels), kLevels[l].name);
    fit.run(kLevels[l]);
    // Two-way correspondences begin from a shape without folds.
    if (kLevels[l].search == Search::ridges && !released && fit.least_volume_share() < 0.1) {
      fit.release();
      released = true;
    }
  }

  progress.report(0.9, "measuring");
  FittedSkull fitted;
  fitted.stages.push_back({"global pose", 1, 0, 0.0, 0.0, posed_s - began_s});
  for (FitStage& stage : fit.take_stages()) fitted.stages.push_back(std::move(stage));
  measure_skull_fit(skull, fit.state().vertices, *surface, options.threads, fitted);
  fitted.vertices.resize(skull.vertices.rows(), 3);
  for (Eigen::Index v = 0; v < fitted.vertices.rows(); ++v) {
    fitted.vertices.row(v) = (frame * fit.state().vertices.row(v).transpose()).transpose();
  }
  const auto similarity =
      fit_similarity(skull.vertices.topRows(skull.boundary_count),
                     fitted.vertices.topRows(skull.boundary_count), {}, FitScale::to_target);
  fitted.input_from_template = similarity.value_or(pose);
  if (fitted.quality.mandible_observed_share == 0.0) {
    fitted.warnings.push_back("no mandible in the input: it lies where the cranium puts it");
  }
  if (fitted.quality.observed_share < 0.6) {
    fitted.warnings.push_back(fmt::format("the input shows {:.0f} % of the skull's outside only",
                                          100.0 * fitted.quality.observed_share));
  }
  return fitted;
}

}  // namespace skullstation
