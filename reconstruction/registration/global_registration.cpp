#include "reconstruction/registration/global_registration.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "core/linear_algebra.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/units.h"
#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_features.h"
#include "reconstruction/registration/point_icp.h"
#include "reconstruction/registration/point_tree.h"
#include "reconstruction/registration/similarity_fit.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

/// Points of a surface with what is needed to find and to measure it.
struct Surface {
  OrientedPoints points;
  PointTree tree;
  PointFeatures features;
  Vector3d center;
  double radius_mm;   // root mean square
  double spacing_mm;  // between neighbours
};

double typical_spacing(const OrientedPoints& points, const PointTree& tree) {
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index i = 0; i < points.size(); i += 7) {
    const auto near = tree.nearest(points.positions.row(i), 2);
    if (near.size() < 2) continue;
    sum += std::sqrt(near[1].squared_distance);
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

/// Radius of the features, in spacings; 5 voxels is the usual choice (METHOD: ALPACA).
constexpr double feature_radius = 6.0;

Result<Surface> make_surface(const TriangleMesh& mesh, const GlobalRegistrationOptions& options) {
  auto points = oriented_samples_of_count(mesh, options.feature_points);
  if (!points) return forward(points);
  PointTree tree(points->positions);
  const Vector3d center = points->positions.colwise().mean().transpose();
  const double radius = std::sqrt((points->positions.rowwise() - center.transpose()).squaredNorm() /
                                  static_cast<double>(points->size()));
  const double spacing = typical_spacing(*points, tree);
  PointFeatures features = point_features(*points, tree, feature_radius * spacing, options.threads);
  return Surface{*std::move(points), std::move(tree), std::move(features), center, radius, spacing};
}

struct Match {
  int source;
  int target;
};

/// For each source point the target points with the most similar features; and the other way.
/// A match that is best both ways comes twice and counts twice.
std::vector<Match> feature_matches(const PointFeatures& source, const PointFeatures& target,
                                   int threads) {
  const auto best_of = [&](const PointFeatures& from, const PointFeatures& to) {
    std::vector<int> best(static_cast<std::size_t>(from.rows()));
    const Eigen::VectorXf squares = to.rowwise().squaredNorm();
    constexpr int block = 128;
    const int count = static_cast<int>(from.rows());
    parallel_for((count + block - 1) / block, threads, [&](int index) {
      const int begin = index * block;
      const int size = std::min(block, count - begin);
      // |a - b|^2 = |a|^2 - 2 a b + |b|^2: a matrix product for the whole block.
      const Eigen::MatrixXf products = to * from.middleRows(begin, size).transpose();
      for (int i = 0; i < size; ++i) {
        Eigen::Index nearest = 0;
        (squares - 2.0F * products.col(i)).minCoeff(&nearest);
        best[static_cast<std::size_t>(begin + i)] = static_cast<int>(nearest);
      }
    });
    return best;
  };
  const std::vector<int> forth = best_of(source, target);
  const std::vector<int> back = best_of(target, source);
  std::vector<Match> matches;
  for (std::size_t s = 0; s < forth.size(); ++s) matches.push_back({static_cast<int>(s), forth[s]});
  for (std::size_t t = 0; t < back.size(); ++t) matches.push_back({back[t], static_cast<int>(t)});
  return matches;
}

std::pair<Points3, Points3> positions_of(const std::vector<Match>& matches, const Surface& source,
                                         const Surface& target) {
  Points3 from(static_cast<Eigen::Index>(matches.size()), 3);
  Points3 to(from.rows(), 3);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    from.row(static_cast<Eigen::Index>(i)) = source.points.positions.row(matches[i].source);
    to.row(static_cast<Eigen::Index>(i)) = target.points.positions.row(matches[i].target);
  }
  return {std::move(from), std::move(to)};
}

double match_support(const Similarity3& transform, const Points3& from, const Points3& to,
                     double reach_mm) {
  const Eigen::Matrix3d matrix = transform.scale * transform.rotation.toRotationMatrix();
  const Points3 gaps =
      ((from * matrix.transpose()).rowwise() + transform.translation.transpose()) - to;
  return (gaps.rowwise().squaredNorm().array() / (reach_mm * reach_mm)).cwiseMin(1.0).sum();
}

/// Graduated non-convexity over the matches: weighted closed-form fits while the kernel narrows
/// from the size of the target to `narrowest_mm`; weights after Zhou et al. 2016, equation 6.
Similarity3 narrow_down(Similarity3 transform, const Points3& from, const Points3& to,
                        double widest_mm, double narrowest_mm, FitScale scale) {
  for (double width = widest_mm; width > narrowest_mm; width /= 1.4) {
    const Eigen::Matrix3d matrix = transform.scale * transform.rotation.toRotationMatrix();
    const Points3 gaps =
        ((from * matrix.transpose()).rowwise() + transform.translation.transpose()) - to;
    const double mu = width * width;
    const Eigen::VectorXd weights =
        (mu / (mu + gaps.rowwise().squaredNorm().array())).square().matrix();
    const auto better = fit_similarity(from, to, weights, scale);
    if (!better) break;
    transform = *better;
  }
  return transform;
}

/// Transforms that three random matches agree on: their triangles must be (nearly) similar, of the
/// same size if the scale is known, and not small.
std::vector<Similarity3> from_triples(const Points3& from, const Points3& to, const Surface& source,
                                      const Surface& target,
                                      const GlobalRegistrationOptions& options) {
  constexpr int tries = 200000;
  constexpr std::size_t wanted = 1500;
  constexpr double similar = 0.9;
  const bool free_scale = options.scale == ScaleKnowledge::unknown;
  const double expected = free_scale ? target.radius_mm / source.radius_mm : 1.0;
  Random random(options.seed);
  std::vector<Similarity3> found;
  const auto count = static_cast<std::uint64_t>(from.rows());
  for (int attempt = 0; attempt < tries && found.size() < wanted; ++attempt) {
    Eigen::Index pick[3];
    for (Eigen::Index& index : pick) index = static_cast<Eigen::Index>(random.below(count));
    double ratio[3];
    bool good = true;
    for (int side = 0; side < 3 && good; ++side) {
      const Eigen::Index a = pick[side];
      const Eigen::Index b = pick[(side + 1) % 3];
      const double length = (from.row(a) - from.row(b)).norm();
      good = length > 0.5 * source.radius_mm;
      ratio[side] = (to.row(a) - to.row(b)).norm() / (expected * std::max(length, 1e-12));
      good = good && (free_scale ? ratio[side] > 0.6 && ratio[side] < 1.7
                                 : ratio[side] > similar && ratio[side] < 1.0 / similar);
    }
    if (!good) continue;
    const auto [least, most] = std::minmax({ratio[0], ratio[1], ratio[2]});
    if (least < similar * most) continue;
    Points3 three_from(3, 3);
    Points3 three_to(3, 3);
    for (int k = 0; k < 3; ++k) {
      three_from.row(k) = from.row(pick[k]);
      three_to.row(k) = to.row(pick[k]);
    }
    const auto fit =
        fit_similarity(three_from, three_to, {}, free_scale ? FitScale::symmetric : FitScale::one);
    if (fit) found.push_back(*fit);
  }
  return found;
}

/// Half turns about the target's principal axes through its middle.
std::vector<Similarity3> half_turns(const Surface& target) {
  const Points3 centered = target.points.positions.rowwise() - target.center.transpose();
  const Eigen::Matrix3d moments = centered.transpose() * centered;
  const SymmetricSpectrum axes = symmetric_spectrum(moments);
  std::vector<Similarity3> turns;
  for (int axis = 0; axis < 3; ++axis) {
    Similarity3 turn;
    turn.rotation = Eigen::AngleAxisd(std::numbers::pi, axes.vectors.col(axis).normalized());
    turn.translation = target.center - turn.rotation * target.center;
    turns.push_back(turn);
  }
  return turns;
}

bool same_place(const Similarity3& a, const Similarity3& b, const Surface& source,
                const Surface& target) {
  const double turn = degrees(a.rotation.angularDistance(b.rotation));
  const double shift = (a * source.center - b * source.center).norm();
  return turn < 15.0 && shift < 0.2 * target.radius_mm;
}

/// Keeps the first of those that end in the same place.
void keep_distinct(std::vector<Similarity3>& transforms, std::size_t most, const Surface& source,
                   const Surface& target) {
  std::vector<Similarity3> kept;
  for (const Similarity3& transform : transforms) {
    if (kept.size() == most) break;
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const Similarity3& other) {
      return same_place(transform, other, source, target);
    });
    if (!known) kept.push_back(transform);
  }
  transforms = std::move(kept);
}

/// Mean truncated squared distance of the source's points from the target, in [0, 1]; a point on
/// a surface that faces elsewhere counts as far.
double cost_of(const Similarity3& transform, const OrientedPoints& source, const Surface& target,
               double reach_mm, int threads) {
  constexpr int block = 128;
  const int count = static_cast<int>(source.size());
  std::vector<double> costs(static_cast<std::size_t>(count), 1.0);
  parallel_for((count + block - 1) / block, threads, [&](int index) {
    for (int i = index * block; i < std::min(count, (index + 1) * block); ++i) {
      const Vector3d moved = transform * source.positions.row(i).transpose();
      const NearPoint near = target.tree.nearest(moved, reach_mm);
      if (near.index < 0) continue;
      const Vector3d normal = target.points.normals.row(near.index);
      const Vector3d own = transform.rotation * source.normals.row(i).transpose();
      if (own.dot(normal) < 0.5) continue;
      const double gap =
          (target.points.positions.row(near.index).transpose() - moved).dot(normal) / reach_mm;
      costs[static_cast<std::size_t>(i)] = std::min(gap * gap, 1.0);
    }
  });
  double sum = 0.0;
  for (const double cost : costs) sum += cost;
  return sum / count;
}

struct Candidate {
  Similarity3 transform;
  double cost = 1.0;
};

}  // namespace

Result<void> GlobalRegistrationOptions::validate() const {
  const auto bad = [](const char* what) {
    return fail(ErrorKind::usage, "global registration", what);
  };
  if (feature_points < 200 || feature_points > 100000) {
    return bad("feature_points must be from 200 to 100000");
  }
  if (fit_points < 100 || fit_points > 100000) return bad("fit_points must be from 100 to 100000");
  if (hypotheses < 1 || hypotheses > 1000) return bad("hypotheses must be from 1 to 1000");
  if (!(least_overlap > 0.0 && least_overlap <= 1.0)) return bad("least_overlap must be in (0, 1]");
  return {};
}

Result<GlobalRegistration> register_globally(const TriangleMesh& source_mesh,
                                             const TriangleMesh& target_mesh,
                                             const GlobalRegistrationOptions& options,
                                             const Progress& progress) {
  if (Result<void> valid = options.validate(); !valid) return forward(valid);
  progress.report(0.0, "features");
  const auto source = make_surface(source_mesh, options);
  if (!source) return forward(source);
  const auto target = make_surface(target_mesh, options);
  if (!target) return forward(target);
  const auto probes = oriented_samples_of_count(source_mesh, options.fit_points);
  if (!probes) return forward(probes);
  const bool free_scale = options.scale == ScaleKnowledge::unknown;
  const FitScale fit_scale = free_scale ? FitScale::symmetric : FitScale::one;

  progress.report(0.3, "hypotheses");
  const std::vector<Match> matches =
      feature_matches(source->features, target->features, options.threads);
  const auto [from, to] = positions_of(matches, *source, *target);
  std::vector<Similarity3> hypotheses = from_triples(from, to, *source, *target, options);
  const double reach_mm = 0.1 * target->radius_mm;
  std::vector<std::pair<double, std::size_t>> order(hypotheses.size());
  parallel_for(static_cast<int>(hypotheses.size()), options.threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    order[i] = {match_support(hypotheses[i], from, to, reach_mm), i};
  });
  std::sort(order.begin(), order.end());
  std::vector<Similarity3> sorted;
  for (const auto& [support, i] : order) sorted.push_back(hypotheses[i]);
  keep_distinct(sorted, static_cast<std::size_t>(options.hypotheses), *source, *target);
  for (Similarity3& hypothesis : sorted) {
    hypothesis = narrow_down(hypothesis, from, to, 4.0 * reach_mm, 0.5 * reach_mm, fit_scale);
  }
  if (sorted.empty()) {  // no features to speak of: principal axes alone must do
    Similarity3 centered;
    if (free_scale) centered.scale = target->radius_mm / source->radius_mm;
    centered.translation = target->center - centered.scale * source->center;
    sorted.push_back(centered);
  }
  // A skull upside down or back to front shares much of its outline with itself.
  const std::vector<Similarity3> turns = half_turns(*target);
  for (std::size_t i = 0, first = std::min<std::size_t>(2, sorted.size()); i < first; ++i) {
    for (const Similarity3& turn : turns) sorted.push_back(turn * sorted[i]);
  }

  progress.report(0.5, "judging hypotheses");
  const double fine_mm = std::max(0.03 * target->radius_mm, 1.5 * target->spacing_mm);
  std::vector<Candidate> candidates;
  for (const Similarity3& hypothesis : sorted) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, "global registration", "was cancelled");
    }
    Similarity3 transform = hypothesis;
    for (const double shrink : {4.0, 2.0, 1.0}) {
      PointIcpOptions icp{.estimate_scale = free_scale && shrink < 4.0,
                          .max_distance_mm = shrink * fine_mm,
                          .max_normal_angle_deg = 60.0,
                          .max_iterations = 12,
                          .tolerance_mm = 1e-3 * target->radius_mm,
                          .threads = options.threads};
      const auto fit = align_points(*probes, target->points, target->tree, transform, icp);
      if (!fit) break;
      transform = fit->target_from_source;
    }
    candidates.push_back(
        {transform, cost_of(transform, *probes, *target, fine_mm, options.threads)});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });

  const Candidate& best = candidates.front();
  PointIcpOptions last{.estimate_scale = free_scale,
                       .max_distance_mm = fine_mm,
                       .max_normal_angle_deg = 45.0,
                       .max_iterations = 40,
                       .tolerance_mm = 1e-5 * target->radius_mm,
                       .threads = options.threads};
  const auto fit = align_points(source->points, target->points, target->tree, best.transform, last);
  if (!fit || fit->overlap < options.least_overlap) {
    return fail(ErrorKind::no_result, "global registration",
                fmt::format("only {:.0f} % of the surface fits the other",
                            100.0 * (fit ? fit->overlap : 0.0)),
                "is it the same kind of object, in the same unit, and not mirrored?");
  }
  GlobalRegistration result{fit->target_from_source, fit->overlap, fit->rms_mm, 0.0};
  for (const Candidate& other : candidates) {
    if (same_place(other.transform, best.transform, *source, *target)) continue;
    result.runner_up = other.cost / std::max(best.cost, 1e-12);
    break;
  }
  return result;
}

}  // namespace skullstation
