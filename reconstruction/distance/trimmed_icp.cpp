#include "reconstruction/distance/trimmed_icp.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/linear_algebra.h"
#include "core/median.h"
#include "core/parallel.h"
#include "reconstruction/distance/pseudo_normals.h"
#include "reconstruction/distance/surface_samples.h"
#include "reconstruction/distance/triangle_bvh.h"

namespace skullstation {

namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

/// About `count` points spread over the surface by area.
Result<std::vector<Eigen::Vector3d>> spread_points(const TriangleMesh& mesh, int count) {
  const double area_mm2 = surface_area(mesh);
  if (!(area_mm2 > 0.0)) return fail(ErrorKind::bad_input, "mesh", "has no surface");
  const auto samples = sample_surface(mesh, count / area_mm2);
  if (!samples) return forward(samples);
  std::vector<Eigen::Vector3d> points;
  const double step_mm2 = area_mm2 / count;
  double gathered_mm2 = 0.5 * step_mm2;
  for (const SurfaceSample& sample : *samples) {
    gathered_mm2 += sample.area_mm2;
    if (gathered_mm2 < step_mm2) continue;
    gathered_mm2 = std::fmod(gathered_mm2, step_mm2);
    points.push_back(sample.point);
  }
  return points;
}

struct Surface {
  TriangleBvh bvh;
  PseudoNormals normals;
  std::vector<Eigen::Vector3d> points;
};

struct Pair {
  Eigen::Vector3d on_a = Eigen::Vector3d::Zero();  // already carried over to B's frame
  Eigen::Vector3d on_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, B's frame
  double distance_mm = 0.0;
};

/// Closest points both ways.
std::vector<Pair> correspondences(const Surface& a, const Surface& b, const Similarity3& b_from_a,
                                  int threads) {
  const Similarity3 a_from_b = b_from_a.inverse();
  const int count_a = static_cast<int>(a.points.size());
  const int count = count_a + static_cast<int>(b.points.size());
  constexpr int block = 256;
  std::vector<Pair> pairs(static_cast<std::size_t>(count));
  parallel_for((count + block - 1) / block, threads, [&](int index) {
    for (int i = index * block; i < std::min(count, (index + 1) * block); ++i) {
      Pair& pair = pairs[static_cast<std::size_t>(i)];
      if (i < count_a) {
        pair.on_a = b_from_a * a.points[static_cast<std::size_t>(i)];
        const ClosestPoint closest = b.bvh.closest(pair.on_a);
        pair.on_b = closest.point;
        pair.normal = b.normals.at(closest).stableNormalized();
      } else {
        pair.on_b = b.points[static_cast<std::size_t>(i - count_a)];
        const ClosestPoint closest = a.bvh.closest(a_from_b * pair.on_b);
        pair.on_a = b_from_a * closest.point;
        pair.normal = b_from_a.rotation * a.normals.at(closest).stableNormalized();
      }
      pair.distance_mm = (pair.on_a - pair.on_b).norm();
    }
  });
  return pairs;
}

void keep_closest(std::vector<Pair>& pairs, double share) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& left, const Pair& right) {
    return left.distance_mm < right.distance_mm;
  });
  pairs.resize(static_cast<std::size_t>(std::ceil(share * static_cast<double>(pairs.size()))));
}

/// What lies farther apart than this belongs to one of the surfaces alone: so many times the median
/// distance, seen from the surface that has the less of its own.
double reach_of(const std::vector<Pair>& pairs, std::size_t count_a) {
  constexpr double kMedians = 5.0;
  constexpr double kLeast_mm = 0.01;
  const auto median_of = [&](std::size_t begin, std::size_t end) {
    std::vector<double> distances;
    for (std::size_t i = begin; i < end; ++i) distances.push_back(pairs[i].distance_mm);
    return median(std::move(distances));
  };
  return std::max(kLeast_mm,
                  kMedians * std::min(median_of(0, count_a), median_of(count_a, pairs.size())));
}

/// The small motion about `center` that brings A's points onto the planes at B's: rotation vector,
/// translation, relative scale. Linearised least squares.
Result<Similarity3> best_step(const std::vector<Pair>& pairs, const Eigen::Vector3d& center,
                              double radius_mm, bool estimate_scale) {
  Matrix7 normal_matrix = Matrix7::Zero();
  Vector7 right_side = Vector7::Zero();
  for (const Pair& pair : pairs) {
    // In units of the radius, so that the unknowns weigh alike.
    const Eigen::Vector3d arm = (pair.on_a - center) / radius_mm;
    Vector7 row;
    row << arm.cross(pair.normal), pair.normal, estimate_scale ? arm.dot(pair.normal) : 0.0;
    const double gap = (pair.on_b - pair.on_a).dot(pair.normal) / radius_mm;
    normal_matrix += row * row.transpose();
    right_side += gap * row;
  }
  if (!estimate_scale) normal_matrix(6, 6) = normal_matrix.trace() / 6.0;
  const SymmetricSpectrum spectrum = symmetric_spectrum(normal_matrix);
  if (!(spectrum.values[0] > 1e-4 * spectrum.values[6])) {
    return fail(ErrorKind::no_result, "alignment",
                "the surfaces slide along each other: their shape doesn't fix the transform");
  }
  const Vector7 step = spectrum.vectors * spectrum.values.cwiseInverse().asDiagonal() *
                       spectrum.vectors.transpose() * right_side;
  const double angle = step.head<3>().norm();
  Similarity3 motion;
  if (angle > 0.0) motion.rotation = Eigen::AngleAxisd(angle, step.head<3>() / angle);
  motion.scale = std::exp(std::clamp(step[6], -0.2, 0.2));
  motion.translation =
      center + radius_mm * step.segment<3>(3) - motion.scale * (motion.rotation * center);
  return motion;
}

struct Extent {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius_mm = 0.0;  // root mean square
};

Extent extent_of(const std::vector<Eigen::Vector3d>& points) {
  Extent extent;
  for (const Eigen::Vector3d& point : points) extent.center += point;
  extent.center /= static_cast<double>(points.size());
  double sum = 0.0;
  for (const Eigen::Vector3d& point : points) sum += (point - extent.center).squaredNorm();
  extent.radius_mm = std::sqrt(sum / static_cast<double>(points.size()));
  return extent;
}

/// First with a fixed share of the pairs, which pulls from afar; then with those alone that belong
/// together, for what only one surface has (a skull's inner walls, beside a scan of the outside)
/// may be more than the share leaves out, and would pull the fit aside.
Result<TrimmedIcpResult> run_from(const Similarity3& start, const Surface& a, const Surface& b,
                                  const TrimmedIcpOptions& options, const Progress& progress) {
  TrimmedIcpResult result;
  result.b_from_a = start;
  const Extent extent = extent_of(b.points);
  double reach_mm = std::numeric_limits<double>::infinity();
  for (const bool by_reach : {false, true}) {
    result.converged = false;
    for (int i = 0; i < options.max_iterations && !result.converged; ++i) {
      if (progress.stop.stop_requested()) {
        return fail(ErrorKind::cancelled, "alignment", "was cancelled");
      }
      progress.report((by_reach ? 0.5 : 0.0) + 0.5 * i / options.max_iterations, "aligning");
      auto pairs = correspondences(a, b, result.b_from_a, options.threads);
      if (by_reach) {
        // Never wider again, so that the iteration comes to rest.
        reach_mm = std::min(reach_mm, reach_of(pairs, a.points.size()));
        std::erase_if(pairs, [&](const Pair& pair) { return pair.distance_mm > reach_mm; });
      } else {
        keep_closest(pairs, options.kept_share);
      }
      const auto step = best_step(pairs, extent.center, extent.radius_mm, options.estimate_scale);
      if (!step) return forward(step);
      result.b_from_a = *step * result.b_from_a;
      ++result.iterations;
      double moved_mm = 0.0;
      double sum = 0.0;
      for (const Pair& pair : pairs) {
        moved_mm = std::max(moved_mm, (*step * pair.on_a - pair.on_a).norm());
        const double gap = (pair.on_b - pair.on_a).dot(pair.normal);
        sum += gap * gap;
      }
      result.converged = moved_mm < options.tolerance_mm;
      result.kept_rms_mm = std::sqrt(sum / static_cast<double>(pairs.size()));
    }
  }
  return result;
}

}  // namespace

Result<void> TrimmedIcpOptions::validate() const {
  const auto bad = [](const char* what) { return fail(ErrorKind::usage, "alignment", what); };
  if (!(kept_share > 0.0 && kept_share <= 1.0)) return bad("kept_share must be in (0, 1]");
  if (samples < 100) return bad("samples must be at least 100");
  if (max_iterations < 1) return bad("max_iterations must be at least 1");
  if (!(tolerance_mm > 0.0)) return bad("tolerance_mm must be positive");
  return {};
}

Result<TrimmedIcpResult> align_by_trimmed_icp(const TriangleMesh& a, const TriangleMesh& b,
                                              const TrimmedIcpOptions& options,
                                              const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  auto points_a = spread_points(a, options.samples);
  if (!points_a) return forward(points_a);
  auto points_b = spread_points(b, options.samples);
  if (!points_b) return forward(points_b);
  const Surface surface_a{TriangleBvh(a), PseudoNormals(a), std::move(*points_a)};
  const Surface surface_b{TriangleBvh(b), PseudoNormals(b), std::move(*points_b)};

  const auto best = run_from(Similarity3{}, surface_a, surface_b, options, progress.part(0.0, 0.5));
  if (!options.estimate_scale || (!best && best.error().kind == ErrorKind::cancelled)) return best;
  const Extent extent_a = extent_of(surface_a.points);
  const Extent extent_b = extent_of(surface_b.points);
  Similarity3 start;
  start.scale = extent_b.radius_mm / extent_a.radius_mm;
  start.translation = extent_b.center - start.scale * extent_a.center;
  const auto other = run_from(start, surface_a, surface_b, options, progress.part(0.5, 1.0));
  if (!other) return best ? best : other;
  return best && best->kept_rms_mm <= other->kept_rms_mm ? best : other;
}

}  // namespace skullstation
