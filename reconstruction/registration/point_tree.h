#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

struct NearPoint {
  int index = -1;  ///< -1: none
  double squared_distance = std::numeric_limits<double>::infinity();
};

/// A k-d tree over points (nanoflann), which are copied. Queries may run on several threads; among
/// equally near points it is always the same one that is given.
class PointTree {
 public:
  explicit PointTree(const Points3& points);
  ~PointTree();
  PointTree(PointTree&&) noexcept;
  PointTree& operator=(PointTree&&) noexcept;

  /// `index` is -1 if no point is nearer than `max_distance`.
  NearPoint nearest(const Eigen::Vector3d& query,
                    double max_distance = std::numeric_limits<double>::infinity()) const;

  /// The `count` nearest points, nearest first; fewer if there are fewer.
  std::vector<NearPoint> nearest(const Eigen::Vector3d& query, int count) const;

  /// All points nearer than `radius`, nearest first.
  std::vector<NearPoint> within(const Eigen::Vector3d& query, double radius) const;

 private:
  struct Index;
  std::unique_ptr<Index> index_;
};

}  // namespace skullstation
