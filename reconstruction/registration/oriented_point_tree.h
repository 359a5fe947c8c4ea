#pragma once

#include <memory>

#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

/// A k-d tree (nanoflann) in which points whose normals differ count as farther apart: the squared
/// distance is |p - q|^2 + (normal_mm |n - m|)^2. So the far end of a bone that is longer than the
/// template's finds the template's end, not its flank. Queries may run on several threads.
class OrientedPointTree {
 public:
  /// A turn by 10 deg counts as much as 7 mm: best of those tried, docs/registration.md.
  static constexpr double normal_mm = 40.0;

  explicit OrientedPointTree(const OrientedPoints& points);
  ~OrientedPointTree();

  /// `index` is -1 where there are no points.
  NearPoint nearest(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const;

 private:
  struct Index;
  std::unique_ptr<Index> index_;
};

}  // namespace skullstation
