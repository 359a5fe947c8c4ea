#include "reconstruction/registration/affine_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/linear_algebra.h"

namespace skullstation {

namespace {

constexpr int kIterations = 12;
constexpr double kMaxAngle_deg = 50.0;
/// Of the mean stiffness of the data: what keeps open directions.
constexpr double kKeep = 1e-2;
constexpr double kMostStretch = 1.25;

using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

OrientedPoints transformed(const Eigen::Affine3d& transform, const OrientedPoints& points) {
  const Eigen::Matrix3d normals = transform.linear().inverse().transpose();
  OrientedPoints result = points;
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    result.positions.row(i) = (transform * points.positions.row(i).transpose()).transpose();
    result.normals.row(i) = (normals * points.normals.row(i).transpose()).normalized().transpose();
  }
  return result;
}

Eigen::Affine3d fit_affine(const OrientedPoints& points, const InputSurface& input,
                           const Eigen::Affine3d& start, double max_distance_mm) {
  if (points.size() < 60) return start;
  Eigen::Affine3d now = start;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const OrientedPoints moved = transformed(now, points);
    const Eigen::Vector3d center = moved.positions.colwise().mean();
    const double radius = std::sqrt((moved.positions.rowwise() - center.transpose()).squaredNorm() /
                                    static_cast<double>(moved.size()));
    std::vector<InputHit> hits;
    std::vector<double> gaps;
    for (Eigen::Index i = 0; i < moved.size(); ++i) {
      hits.push_back(input.nearest_sample(moved.positions.row(i), moved.normals.row(i),
                                          max_distance_mm, kMaxAngle_deg));
      if (!hits.back().valid) continue;
      gaps.push_back(
          std::abs(hits.back().normal.dot(hits.back().point - moved.positions.row(i).transpose())));
    }
    if (static_cast<Eigen::Index>(gaps.size()) < moved.size() / 3) return start;
    const double nu = std::max(3.0 * median_of(std::move(gaps)), 0.5);
    Matrix12 matrix = Matrix12::Zero();
    Vector12 right = Vector12::Zero();
    for (Eigen::Index i = 0; i < moved.size(); ++i) {
      const InputHit& hit = hits[static_cast<std::size_t>(i)];
      if (!hit.valid) continue;
      const Eigen::Vector3d arm = (moved.positions.row(i).transpose() - center) / radius;
      const double gap = hit.normal.dot(hit.point - moved.positions.row(i).transpose());
      Vector12 row;
      row << arm.x() * hit.normal, arm.y() * hit.normal, arm.z() * hit.normal, hit.normal;
      const double weight = std::exp(-0.5 * gap * gap / (nu * nu));
      matrix += weight * row * row.transpose();
      right += weight * gap * row;
    }
    matrix.diagonal().array() += kKeep * matrix.trace() / 12.0;
    const Vector12 step = matrix.ldlt().solve(right);
    Eigen::Matrix3d stretch = Eigen::Matrix3d::Identity();
    for (int c = 0; c < 3; ++c) stretch.col(c) += step.segment<3>(3 * c) / radius;
    Eigen::Affine3d motion;
    motion.linear() = stretch;
    motion.translation() = center + step.tail<3>() - stretch * center;
    now = motion * now;
    if (step.norm() < 0.02) break;
  }
  const SingularValues3 change = singular_values(now.linear() * start.linear().inverse());
  const Eigen::Vector3d lengths = change.values;
  if (lengths[0] > kMostStretch || lengths[2] < 1.0 / kMostStretch) return start;
  return now;
}

}  // namespace skullstation
