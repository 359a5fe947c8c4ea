#include "reconstruction/registration/point_icp.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/linear_algebra.h"
#include "core/parallel.h"
#include "core/units.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

struct Pair {
  Vector3d moved;  // source point in the target's frame
  Vector3d normal;
  double gap = 0.0;  // along the normal, target - moved
  bool counts = false;
};

std::vector<Pair> pairs_of(const OrientedPoints& source, const OrientedPoints& target,
                           const PointTree& tree, const Similarity3& transform,
                           const PointIcpOptions& options) {
  const double least_cosine = std::cos(radians(options.max_normal_angle_deg));
  constexpr int block = 128;
  std::vector<Pair> pairs(static_cast<std::size_t>(source.size()));
  const int count = static_cast<int>(source.size());
  parallel_for((count + block - 1) / block, options.threads, [&](int index) {
    for (int i = index * block; i < std::min(count, (index + 1) * block); ++i) {
      Pair& pair = pairs[static_cast<std::size_t>(i)];
      pair.moved = transform * source.positions.row(i).transpose();
      const NearPoint near = tree.nearest(pair.moved, options.max_distance_mm);
      if (near.index < 0) continue;
      pair.normal = target.normals.row(near.index);
      const Vector3d own = transform.rotation * source.normals.row(i).transpose();
      pair.gap = (target.positions.row(near.index).transpose() - pair.moved).dot(pair.normal);
      pair.counts = own.dot(pair.normal) >= least_cosine;
    }
  });
  return pairs;
}

double median_gap(const std::vector<Pair>& pairs) {
  std::vector<double> gaps;
  for (const Pair& pair : pairs) {
    if (pair.counts) gaps.push_back(std::abs(pair.gap));
  }
  if (gaps.empty()) return 0.0;
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

}  // namespace

Result<void> PointIcpOptions::validate() const {
  const auto bad = [](const char* what) { return fail(ErrorKind::usage, "alignment", what); };
  if (!(max_distance_mm > 0.0)) return bad("max_distance_mm must be positive");
  if (!(max_normal_angle_deg > 0.0 && max_normal_angle_deg <= 180.0)) {
    return bad("max_normal_angle_deg must be in (0, 180]");
  }
  if (max_iterations < 1) return bad("max_iterations must be at least 1");
  if (!(tolerance_mm > 0.0)) return bad("tolerance_mm must be positive");
  return {};
}

Result<PointFit> align_points(const OrientedPoints& source, const OrientedPoints& target,
                              const PointTree& target_tree, const Similarity3& start,
                              const PointIcpOptions& options) {
  if (Result<void> valid = options.validate(); !valid) return forward(valid);
  PointFit fit;
  fit.target_from_source = start;
  const Vector3d source_center = source.positions.colwise().mean().transpose();
  const double source_radius =
      std::sqrt((source.positions.rowwise() - source_center.transpose()).squaredNorm() /
                static_cast<double>(source.size()));

  for (bool moving = true; moving && fit.iterations < options.max_iterations; ++fit.iterations) {
    const std::vector<Pair> pairs =
        pairs_of(source, target, target_tree, fit.target_from_source, options);
    // Tukey's constant for Welsch's function: 95 % efficiency under normal noise.
    const double nu = std::max(3.0 * median_gap(pairs), 1e-6);
    const Vector3d center = fit.target_from_source * source_center;
    const double radius = fit.target_from_source.scale * source_radius;
    Matrix7 normal_matrix = Matrix7::Zero();
    Vector7 right_side = Vector7::Zero();
    int count = 0;
    for (const Pair& pair : pairs) {
      if (!pair.counts) continue;
      const double weight = std::exp(-0.5 * (pair.gap * pair.gap) / (nu * nu));
      const Vector3d arm = (pair.moved - center) / radius;
      Vector7 row;
      row << arm.cross(pair.normal), pair.normal,
          options.estimate_scale ? arm.dot(pair.normal) : 0.0;
      normal_matrix += weight * row * row.transpose();
      right_side += weight * pair.gap / radius * row;
      ++count;
    }
    if (!options.estimate_scale) normal_matrix(6, 6) = normal_matrix.trace() / 6.0;
    if (count < 20) return fail(ErrorKind::no_result, "alignment", "the surfaces do not overlap");
    const SymmetricSpectrum spectrum = symmetric_spectrum(normal_matrix);
    if (!(spectrum.values[0] > 1e-5 * spectrum.values[6])) {
      return fail(ErrorKind::no_result, "alignment", "what overlaps slides freely");
    }
    const Vector7 step = spectrum.vectors * spectrum.values.cwiseInverse().asDiagonal() *
                         spectrum.vectors.transpose() * right_side;
    Similarity3 motion;
    const double angle = step.head<3>().norm();
    if (angle > 0.0) motion.rotation = Eigen::AngleAxisd(angle, step.head<3>() / angle);
    motion.scale = std::exp(std::clamp(step[6], -0.1, 0.1));
    motion.translation =
        center + radius * step.segment<3>(3) - motion.scale * (motion.rotation * center);
    fit.target_from_source = motion * fit.target_from_source;
    moving = radius * step.norm() > options.tolerance_mm;
  }

  double squares = 0.0;
  int count = 0;
  for (const Pair& pair : pairs_of(source, target, target_tree, fit.target_from_source, options)) {
    if (!pair.counts) continue;
    squares += pair.gap * pair.gap;
    ++count;
  }
  if (count == 0) return fail(ErrorKind::no_result, "alignment", "the surfaces do not overlap");
  fit.overlap = static_cast<double>(count) / static_cast<double>(source.size());
  fit.rms_mm = std::sqrt(squares / count);
  return fit;
}

}  // namespace skullstation
