#include "reconstruction/registration/point_tree.h"

#include <algorithm>
#include <nanoflann.hpp>
#include <utility>

namespace skullstation {

namespace {

struct Cloud {
  Points3 points;
  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(points.rows()); }
  double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return points(static_cast<Eigen::Index>(index), static_cast<Eigen::Index>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, int>;

bool nearer(const NearPoint& a, const NearPoint& b) {
  return std::pair(a.squared_distance, a.index) < std::pair(b.squared_distance, b.index);
}

}  // namespace

struct PointTree::Index {
  explicit Index(const Points3& points) : cloud{points}, tree(3, cloud) {}
  Cloud cloud;
  Tree tree;
};

PointTree::PointTree(const Points3& points) : index_(std::make_unique<Index>(points)) {}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;
PointTree& PointTree::operator=(PointTree&&) noexcept = default;

NearPoint PointTree::nearest(const Eigen::Vector3d& query, double max_distance) const {
  NearPoint found;
  nanoflann::KNNResultSet<double, int> results(1);
  results.init(&found.index, &found.squared_distance);
  found.squared_distance = max_distance * max_distance;  // the search prunes by what is there
  index_->tree.findNeighbors(results, query.data(), nanoflann::SearchParams());
  if (results.size() == 0) return {};
  return found;
}

std::vector<NearPoint> PointTree::nearest(const Eigen::Vector3d& query, int count) const {
  std::vector<int> indices(static_cast<std::size_t>(count));
  std::vector<double> squared(static_cast<std::size_t>(count));
  const std::size_t found = index_->tree.knnSearch(query.data(), static_cast<std::size_t>(count),
                                                   indices.data(), squared.data());
  std::vector<NearPoint> points;
  for (std::size_t i = 0; i < found; ++i) points.push_back({indices[i], squared[i]});
  return points;
}

std::vector<NearPoint> PointTree::within(const Eigen::Vector3d& query, double radius) const {
  std::vector<std::pair<int, double>> matches;
  index_->tree.radiusSearch(query.data(), radius * radius, matches,
                            nanoflann::SearchParams(32, 0.0F, false));
  std::vector<NearPoint> points;
  points.reserve(matches.size());
  for (const auto& [index, squared] : matches) points.push_back({index, squared});
  std::sort(points.begin(), points.end(), nearer);
  return points;
}

}  // namespace skullstation
