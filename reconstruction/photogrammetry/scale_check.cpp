#include "reconstruction/photogrammetry/scale_check.h"

#include <cmath>

namespace skullstation {

namespace {

/// Root mean square distance of the cameras' centres from their mean [mm].
double spread_mm(const std::vector<Rigid3>& poses) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const double count = static_cast<double>(poses.size());
  for (const Rigid3& pose : poses) mean += pose.inverse().translation / count;
  double sum = 0.0;
  for (const Rigid3& pose : poses) sum += (pose.inverse().translation - mean).squaredNorm();
  return std::sqrt(sum / count);
}

}  // namespace

std::optional<double> scale_between(const std::vector<Rigid3>& first,
                                    const std::vector<Rigid3>& second, double least_spread_mm) {
  if (first.size() < 3 || first.size() != second.size()) return std::nullopt;
  const double of_first = spread_mm(first);
  const double of_second = spread_mm(second);
  if (!(of_first > least_spread_mm) || !(of_second > least_spread_mm)) return std::nullopt;
  return of_second / of_first;
}

}  // namespace skullstation
