#include "reconstruction/distance/triangle_bvh.h"

#include <algorithm>
#include <array>

namespace skullstation {

namespace {

constexpr int leaf_size = 4;

ClosestPoint at(const Eigen::Vector3d& query, const Eigen::Vector3d& point,
                TriangleFeature feature) {
  return {point, (query - point).norm(), -1, feature};
}

}  // namespace

ClosestPoint closest_point_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a,
                                       const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  using enum TriangleFeature;
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d ap = query - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return at(query, a, corner0);

  const Eigen::Vector3d bp = query - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return at(query, b, corner1);

  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return at(query, a + d1 / (d1 - d3) * ab, edge0);

  const Eigen::Vector3d cp = query - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return at(query, c, corner2);

  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return at(query, a + d2 / (d2 - d6) * ac, edge2);

  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return at(query, b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), edge1);
  }
  const double area = va + vb + vc;
  return at(query, a + vb / area * ab + vc / area * ac, face);
}

TriangleBvh::TriangleBvh(const TriangleMesh& mesh) {
  const auto count = static_cast<std::size_t>(mesh.triangles.rows());
  leaves_.resize(count);
  std::vector<Eigen::Vector3d> centroids(count);
  for (std::size_t f = 0; f < count; ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    Leaf& leaf = leaves_[f];
    leaf.a = mesh.vertices.row(mesh.triangles(row, 0));
    leaf.b = mesh.vertices.row(mesh.triangles(row, 1));
    leaf.c = mesh.vertices.row(mesh.triangles(row, 2));
    leaf.triangle = static_cast<int>(f);
    centroids[f] = (leaf.a + leaf.b + leaf.c) / 3.0;
  }
  if (count == 0) return;
  nodes_.reserve(count);
  build(0, static_cast<int>(count), centroids);
}

/// Splits at the median along the longest side of the centroids' box. Returns the node's index;
/// the first child follows its parent at once. `centroids` belongs to the mesh's numbering.
int TriangleBvh::build(int begin, int end, std::vector<Eigen::Vector3d>& centroids) {
  const auto index = static_cast<std::size_t>(nodes_.size());
  nodes_.emplace_back();
  Eigen::AlignedBox3d box;
  Eigen::AlignedBox3d centroid_box;
  for (int i = begin; i < end; ++i) {
    const Leaf& leaf = leaves_[static_cast<std::size_t>(i)];
    box.extend(leaf.a).extend(leaf.b).extend(leaf.c);
    centroid_box.extend(centroids[static_cast<std::size_t>(leaf.triangle)]);
  }
  nodes_[index].box = box;
  if (end - begin <= leaf_size) {
    nodes_[index].first = begin;
    nodes_[index].count = end - begin;
    return static_cast<int>(index);
  }
  int axis = 0;
  centroid_box.sizes().maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(leaves_.begin() + begin, leaves_.begin() + middle, leaves_.begin() + end,
                   [&](const Leaf& left, const Leaf& right) {
                     const double l = centroids[static_cast<std::size_t>(left.triangle)][axis];
                     const double r = centroids[static_cast<std::size_t>(right.triangle)][axis];
                     return l != r ? l < r : left.triangle < right.triangle;
                   });
  build(begin, middle, centroids);
  nodes_[index].first = build(middle, end, centroids);
  return static_cast<int>(index);
}

ClosestPoint TriangleBvh::closest(const Eigen::Vector3d& query, double max_distance_mm) const {
  ClosestPoint best;
  best.distance_mm = max_distance_mm;
  double best_squared = max_distance_mm * max_distance_mm;
  if (nodes_.empty()) return best;

  struct Entry {
    int node;
    double squared_distance;
  };
  std::array<Entry, 64> stack;  // halving 2^31 triangles is 31 levels deep
  std::size_t top = 0;
  stack[top++] = {0, nodes_[0].box.squaredExteriorDistance(query)};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.squared_distance >= best_squared) continue;
    const Node& node = nodes_[static_cast<std::size_t>(entry.node)];
    if (node.count > 0) {
      for (int i = node.first; i < node.first + node.count; ++i) {
        const Leaf& leaf = leaves_[static_cast<std::size_t>(i)];
        ClosestPoint candidate = closest_point_on_triangle(query, leaf.a, leaf.b, leaf.c);
        if (!(candidate.distance_mm < best.distance_mm)) continue;  // no NaN of a sliver either
        candidate.triangle = leaf.triangle;
        best = candidate;
        best_squared = best.distance_mm * best.distance_mm;
      }
      continue;
    }
    Entry near{entry.node + 1, 0.0};
    Entry far{node.first, 0.0};
    near.squared_distance =
        nodes_[static_cast<std::size_t>(near.node)].box.squaredExteriorDistance(query);
    far.squared_distance =
        nodes_[static_cast<std::size_t>(far.node)].box.squaredExteriorDistance(query);
    if (far.squared_distance < near.squared_distance) std::swap(near, far);
    stack[top++] = far;
    stack[top++] = near;
  }
  return best;
}

}  // namespace skullstation
