#include "reconstruction/registration/curvature_measure.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace skullstation {

Eigen::VectorXd curvature_measure(const OrientedPoints& points, const PointTree& tree,
                                  double radius_mm, int threads) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(points.size());
  constexpr int kChunk = 256;
  const auto count = static_cast<int>(points.size());
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      const Eigen::Vector3d position = points.positions.row(i);
      const Eigen::Vector3d normal = points.normals.row(i);
      double sum = 0.0;
      int neighbors = 0;
      for (const NearPoint& near : tree.within(position, radius_mm)) {
        if (near.index == i || near.squared_distance <= 0.0) continue;
        const Eigen::Vector3d other = points.normals.row(near.index);
        if (other.dot(normal) < -0.2) continue;  // the far side of a thin wall
        sum += (other - normal).squaredNorm() / near.squared_distance;
        ++neighbors;
      }
      if (neighbors > 0) result[i] = std::sqrt(sum / neighbors);
    }
  });
  return result;
}

double upper_quantile(Eigen::VectorXd values, double share) {
  if (values.size() == 0) return 0.0;
  const auto rank =
      std::min(values.size() - 1,
               static_cast<Eigen::Index>((1.0 - share) * static_cast<double>(values.size())));
  std::nth_element(values.data(), values.data() + rank, values.data() + values.size());
  return values[rank];
}

}  // namespace skullstation
