#include "reconstruction/registration/oriented_point_tree.h"

#include <nanoflann.hpp>

namespace skullstation {

namespace {

using Rows6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

struct Cloud {
  Rows6 rows;
  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(rows.rows()); }
  double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return rows(static_cast<Eigen::Index>(index), static_cast<Eigen::Index>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 6, int>;

Rows6 rows_of(const OrientedPoints& points) {
  Rows6 rows(points.size(), 6);
  rows << points.positions, OrientedPointTree::normal_mm * points.normals;
  return rows;
}

}  // namespace

struct OrientedPointTree::Index {
  explicit Index(const OrientedPoints& points) : cloud{rows_of(points)}, tree(6, cloud) {}
  Cloud cloud;
  Tree tree;
};

OrientedPointTree::OrientedPointTree(const OrientedPoints& points)
    : index_(std::make_unique<Index>(points)) {}
OrientedPointTree::~OrientedPointTree() = default;

NearPoint OrientedPointTree::nearest(const Eigen::Vector3d& position,
                                     const Eigen::Vector3d& normal) const {
  Eigen::Matrix<double, 6, 1> query;
  query << position, normal_mm * normal;
  NearPoint found;
  index_->tree.knnSearch(query.data(), 1, &found.index, &found.squared_distance);
  return found;
}

}  // namespace skullstation
