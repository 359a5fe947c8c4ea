#include "reconstruction/registration/point_features.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/parallel.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;
using Histogram = Eigen::Matrix<float, 1, 33>;

constexpr int bins = 11;
constexpr int block = 64;

int bin_of(double value, double low, double high) {
  const int bin = static_cast<int>(std::floor(bins * (value - low) / (high - low)));
  return std::clamp(bin, 0, bins - 1);
}

/// Adds the three angles of a pair of oriented points to the histogram (Rusu et al. 2009,
/// equation 1): the Darboux frame stands on the first point.
void add_pair(const Vector3d& p, const Vector3d& p_normal, const Vector3d& q,
              const Vector3d& q_normal, Histogram& histogram) {
  Vector3d line = q - p;
  const double distance = line.norm();
  if (!(distance > 0.0)) return;
  line /= distance;
  Vector3d v = p_normal.cross(line);
  const double length = v.norm();
  if (length < 1e-9) return;
  v /= length;
  const Vector3d w = p_normal.cross(v);
  const double alpha = v.dot(q_normal);
  const double phi = p_normal.dot(line);
  const double theta = std::atan2(w.dot(q_normal), p_normal.dot(q_normal));
  histogram[bin_of(alpha, -1.0, 1.0)] += 1.0F;
  histogram[bins + bin_of(phi, -1.0, 1.0)] += 1.0F;
  histogram[2 * bins + bin_of(theta, -std::numbers::pi, std::numbers::pi)] += 1.0F;
}

/// Each of the three parts adds up to 100.
void normalize(Histogram& histogram) {
  for (int part = 0; part < 3; ++part) {
    const float sum = histogram.segment<bins>(part * bins).sum();
    if (sum > 0.0F) histogram.segment<bins>(part * bins) *= 100.0F / sum;
  }
}

template <class Work>
void for_each_point(Eigen::Index count, int threads, const Work& work) {
  parallel_for(static_cast<int>((count + block - 1) / block), threads, [&](int index) {
    const Eigen::Index begin = static_cast<Eigen::Index>(index) * block;
    for (Eigen::Index i = begin; i < std::min<Eigen::Index>(count, begin + block); ++i) work(i);
  });
}

}  // namespace

PointFeatures point_features(const OrientedPoints& points, const PointTree& tree, double radius_mm,
                             int threads) {
  const Eigen::Index count = points.size();
  std::vector<std::vector<NearPoint>> neighbours(static_cast<std::size_t>(count));
  PointFeatures simple = PointFeatures::Zero(count, 33);
  for_each_point(count, threads, [&](Eigen::Index i) {
    auto& near = neighbours[static_cast<std::size_t>(i)];
    near = tree.within(points.positions.row(i), radius_mm);
    Histogram histogram = Histogram::Zero();
    for (const NearPoint& other : near) {
      if (other.index == i) continue;
      add_pair(points.positions.row(i), points.normals.row(i), points.positions.row(other.index),
               points.normals.row(other.index), histogram);
    }
    normalize(histogram);
    simple.row(i) = histogram;
  });

  PointFeatures features(count, 33);
  for_each_point(count, threads, [&](Eigen::Index i) {
    Histogram blended = Histogram::Zero();
    for (const NearPoint& other : neighbours[static_cast<std::size_t>(i)]) {
      if (other.index == i || !(other.squared_distance > 0.0)) continue;
      blended += simple.row(other.index) / static_cast<float>(std::sqrt(other.squared_distance));
    }
    normalize(blended);
    blended += simple.row(i);
    normalize(blended);
    features.row(i) = blended;
  });
  return features;
}

}  // namespace skullstation
