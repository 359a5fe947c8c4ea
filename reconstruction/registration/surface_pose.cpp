#include "reconstruction/registration/surface_pose.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.h"
#include "core/parallel.h"
#include "reconstruction/registration/global_registration.h"
#include "reconstruction/registration/oriented_point_tree.h"
#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/similarity_fit.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

constexpr int kSourcePoints = 3000;
constexpr int kTargetPoints = 12000;
/// First what people differ by, then without the pairs that differ most.
constexpr double kReaches_mm[] = {15.0, 10.0};
constexpr double kLeastCosine = 0.7;
constexpr int kMostIterations = 200;
constexpr double kTolerance_mm = 2e-3;

struct Partners {
  Points3 positions;        // #source x 3, on the target
  Eigen::VectorXd weights;  // #source; 0: none within reach
};

/// The target's points that are most alike in place and direction; those farther off than most
/// count less (Welsch, scale from the median).
Partners partners_of(const OrientedPoints& source, const OrientedPoints& target,
                     const OrientedPointTree& tree, const Similarity3& target_from_source,
                     double reach_mm, int threads) {
  constexpr int block = 128;
  const int count = static_cast<int>(source.size());
  Partners partners{source.positions, Eigen::VectorXd::Zero(count)};
  Eigen::VectorXd gaps = Eigen::VectorXd::Constant(count, -1.0);
  parallel_for((count + block - 1) / block, threads, [&](int index) {
    for (int i = index * block; i < std::min(count, (index + 1) * block); ++i) {
      const Vector3d moved = target_from_source * source.positions.row(i).transpose();
      const Vector3d normal = target_from_source.rotation * source.normals.row(i).transpose();
      const int near = tree.nearest(moved, normal).index;
      partners.positions.row(i) = target.positions.row(near);
      const double gap = (target.positions.row(near).transpose() - moved).norm();
      if (gap <= reach_mm && normal.dot(target.normals.row(near)) >= kLeastCosine) gaps[i] = gap;
    }
  });
  std::vector<double> counted;
  for (const double gap : gaps) {
    if (gap >= 0.0) counted.push_back(gap);
  }
  const double scale_mm = std::max(3.0 * median(counted), 1e-6);
  for (int i = 0; i < count; ++i) {
    if (gaps[i] < 0.0) continue;
    partners.weights[i] = std::exp(-0.5 * gaps[i] * gaps[i] / (scale_mm * scale_mm));
  }
  return partners;
}

double farthest_move_mm(const Similarity3& a, const Similarity3& b, const OrientedPoints& points) {
  double squared = 0.0;
  for (const auto& x : points.positions.rowwise()) {
    squared = std::max(squared, (a * x.transpose() - b * x.transpose()).squaredNorm());
  }
  return std::sqrt(squared);
}

/// From near to where the surfaces lie on each other, the size free. Pairs by place and direction
/// pull along the surface too: by nearest points and their planes alone, the vault of a skull whose
/// face is lost slides about in the template's, which is as round. It creeps in the end, hence the
/// small tolerance.
Similarity3 settle(const OrientedPoints& source, const OrientedPoints& target,
                   Similarity3 target_from_source, int threads) {
  const OrientedPointTree tree(target);
  for (const double reach_mm : kReaches_mm) {
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const Partners partners =
          partners_of(source, target, tree, target_from_source, reach_mm, threads);
      const auto better = fit_similarity(source.positions, partners.positions, partners.weights,
                                         FitScale::symmetric);
      if (!better) break;  // too little is within reach: the pose stands
      const double move_mm = farthest_move_mm(*better, target_from_source, source);
      target_from_source = *better;
      if (move_mm < kTolerance_mm) break;
    }
  }
  return target_from_source;
}

}  // namespace

Result<Similarity3> find_surface_pose(const TriangleMesh& surface, const TriangleMesh& input,
                                      const SurfacePoseOptions& options) {
  GlobalRegistrationOptions global;
  global.scale = options.unit_unknown ? ScaleKnowledge::unknown : ScaleKnowledge::same_unit;
  global.seed = options.seed;
  global.threads = options.threads;
  // People differ by more than the tolerance of a pose; what follows refuses what does not fit.
  global.least_overlap = 0.22;
  const auto found = register_globally(input, surface, global);
  if (!found) return forward(found);

  // The input may be a part: its points look for partners on the template.
  const auto source = oriented_samples_of_count(input, kSourcePoints);
  if (!source) return forward(source);
  const auto target = oriented_samples_of_count(surface, kTargetPoints);
  if (!target) return forward(target);
  return settle(*source, *target, found->target_from_source, options.threads).inverse();
}

}  // namespace skullstation
