#include "reconstruction/templates/remeshing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>

#include <set>
#include <utility>
#include <vector>

namespace skullstation {

namespace {

using Vector = Eigen::Vector3d;
using Corners = std::array<int, 3>;
using Edge = std::pair<int, int>;

Edge edge_of(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

class Remesher {
 public:
  Remesher(const TriangleMesh& mesh, const RemeshingOptions& options) : options_(options) {
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      points_.emplace_back(mesh.vertices.row(v));
    }
    for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
      faces_.push_back({mesh.triangles(f, 0), mesh.triangles(f, 1), mesh.triangles(f, 2)});
    }
  }

  TriangleMesh run() {
    for (int round = 0; round < options_.rounds; ++round) {
      split_long_edges();
      collapse_short_edges();
      flip_edges();
      relax();
    }
    return result();
  }

 private:
  struct Wings {
    int left = -1;  ///< triangle that runs along the edge from its lesser to its greater vertex
    int right = -1;
  };

  std::map<Edge, Wings> edges() const {
    std::map<Edge, Wings> result;
    for (int f = 0; f < static_cast<int>(faces_.size()); ++f) {
      for (int i = 0; i < 3; ++i) {
        const int a = face(f)[static_cast<std::size_t>(i)];
        const int b = face(f)[static_cast<std::size_t>((i + 1) % 3)];
        (a < b ? result[{a, b}].left : result[{b, a}].right) = f;
      }
    }
    return result;
  }

  std::vector<char> boundary(const std::map<Edge, Wings>& all) const {
    std::vector<char> result(points_.size(), 0);
    for (const auto& [edge, wings] : all) {
      if (wings.left >= 0 && wings.right >= 0) continue;
      result[static_cast<std::size_t>(edge.first)] = 1;
      result[static_cast<std::size_t>(edge.second)] = 1;
    }
    return result;
  }

  const Vector& point(int v) const { return points_[static_cast<std::size_t>(v)]; }
  const Corners& face(int f) const { return faces_[static_cast<std::size_t>(f)]; }

  bool is_corner(int v) const { return options_.is_corner && options_.is_corner(point(v)); }

  /// Length of the edge in units of the wanted one.
  double relative_length(const Edge& edge) const {
    const Vector& a = point(edge.first);
    const Vector& b = point(edge.second);
    return (a - b).norm() / options_.edge_mm(0.5 * (a + b));
  }

  int opposite(int f, const Edge& edge) const {
    for (const int v : face(f)) {
      if (v != edge.first && v != edge.second) return v;
    }
    return -1;
  }

  std::vector<std::pair<double, Edge>> by_length(const std::map<Edge, Wings>& all) const {
    std::vector<std::pair<double, Edge>> result;
    for (const auto& [edge, wings] : all) result.emplace_back(relative_length(edge), edge);
    std::ranges::sort(result);
    return result;
  }

  void split_long_edges() {
    for (bool again = true; again;) {
      again = false;
      const std::map<Edge, Wings> all = edges();
      std::vector<std::pair<double, Edge>> order = by_length(all);
      std::vector<char> touched(faces_.size(), 0);
      for (auto it = order.rbegin(); it != order.rend() && it->first > 4.0 / 3.0; ++it) {
        const Edge edge = it->second;
        const Wings wings = all.at(edge);
        bool busy = false;
        for (const int f : {wings.left, wings.right}) {
          busy = busy || (f >= 0 && touched[static_cast<std::size_t>(f)] != 0);
        }
        if (busy) continue;
        const int middle = static_cast<int>(points_.size());
        points_.emplace_back(0.5 * (point(edge.first) + point(edge.second)));
        for (const int f : {wings.left, wings.right}) {
          if (f < 0) continue;
          touched[static_cast<std::size_t>(f)] = 1;
          Corners near = face(f);
          Corners far = face(f);
          std::ranges::replace(near, edge.second, middle);
          std::ranges::replace(far, edge.first, middle);
          faces_[static_cast<std::size_t>(f)] = near;
          faces_.push_back(far);
        }
        again = true;
      }
    }
  }

  void collapse_short_edges() {
    for (int pass = 0; pass < 6; ++pass) {
      const std::map<Edge, Wings> all = edges();
      const std::vector<char> rim = boundary(all);
      std::vector<std::set<int>> neighbors(points_.size());
      for (const auto& [edge, wings] : all) {
        neighbors[static_cast<std::size_t>(edge.first)].insert(edge.second);
        neighbors[static_cast<std::size_t>(edge.second)].insert(edge.first);
      }
      std::vector<std::vector<int>> around(points_.size());
      for (int f = 0; f < static_cast<int>(faces_.size()); ++f) {
        for (const int v : face(f)) around[static_cast<std::size_t>(v)].push_back(f);
      }
      std::vector<char> busy(points_.size(), 0);
      std::vector<char> gone(faces_.size(), 0);
      bool any = false;
      for (const auto& [length, edge] : by_length(all)) {
        if (length > 0.8) break;
        auto [kept, lost] = edge;
        const Wings wings = all.at(edge);
        const bool on_rim = wings.left < 0 || wings.right < 0;
        const bool kept_rim = rim[static_cast<std::size_t>(kept)] != 0;
        const bool lost_rim = rim[static_cast<std::size_t>(lost)] != 0;
        if (kept_rim && lost_rim && !on_rim) continue;  // would pinch the boundary
        if (lost_rim && !kept_rim) std::swap(kept, lost);
        if (is_corner(lost) && is_corner(kept)) continue;
        if (is_corner(lost)) std::swap(kept, lost);
        if (busy_around(neighbors, busy, kept, lost)) continue;
        std::vector<int> common;
        std::ranges::set_intersection(neighbors[static_cast<std::size_t>(kept)],
                                      neighbors[static_cast<std::size_t>(lost)],
                                      std::back_inserter(common));
        if (common.size() != (on_rim ? 1U : 2U)) continue;  // link condition
        const bool kept_fixed =
            is_corner(kept) || (rim[static_cast<std::size_t>(kept)] != 0 && !on_rim);
        const Vector place = kept_fixed ? point(kept) : Vector(0.5 * (point(kept) + point(lost)));
        if (turns_over(around, kept, lost, place)) continue;
        for (const int f : around[static_cast<std::size_t>(lost)]) {
          Corners& corners = faces_[static_cast<std::size_t>(f)];
          if (std::ranges::count(corners, kept) > 0) {
            gone[static_cast<std::size_t>(f)] = 1;
          } else {
            std::ranges::replace(corners, lost, kept);
          }
        }
        points_[static_cast<std::size_t>(kept)] = place;
        for (const int v : {kept, lost}) {
          busy[static_cast<std::size_t>(v)] = 1;
          for (const int n : neighbors[static_cast<std::size_t>(v)]) {
            busy[static_cast<std::size_t>(n)] = 1;
          }
        }
        any = true;
      }
      std::vector<Corners> left;
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        if (gone[f] == 0) left.push_back(faces_[f]);
      }
      faces_ = std::move(left);
      drop_unused();
      if (!any) break;
    }
  }

  static bool busy_around(const std::vector<std::set<int>>& neighbors,
                          const std::vector<char>& busy, int a, int b) {
    const auto any = [&](int v) {
      return busy[static_cast<std::size_t>(v)] != 0 ||
             std::ranges::any_of(neighbors[static_cast<std::size_t>(v)],
                                 [&](int n) { return busy[static_cast<std::size_t>(n)] != 0; });
    };
    return any(a) || any(b);
  }

  bool turns_over(const std::vector<std::vector<int>>& around, int kept, int lost,
                  const Vector& place) const {
    for (const auto& [center, other] : {std::pair(kept, lost), std::pair(lost, kept)}) {
      for (const int f : around[static_cast<std::size_t>(center)]) {
        const Corners& corners = face(f);
        if (std::ranges::count(corners, other) > 0) continue;
        std::array<Vector, 3> now;
        std::array<Vector, 3> then;
        for (std::size_t i = 0; i < 3; ++i) {
          now[i] = point(corners[i]);
          then[i] = corners[i] == center ? place : now[i];
        }
        const Vector a = (now[1] - now[0]).cross(now[2] - now[0]);
        const Vector b = (then[1] - then[0]).cross(then[2] - then[0]);
        if (a.dot(b) < 0.2 * a.norm() * b.norm()) return true;
      }
    }
    return false;
  }

  void flip_edges() {
    for (int pass = 0; pass < 3; ++pass) {
      const std::map<Edge, Wings> all = edges();
      std::vector<char> touched(faces_.size(), 0);
      std::set<Edge> made;
      bool any = false;
      for (const auto& [edge, wings] : all) {
        if (wings.left < 0 || wings.right < 0) continue;
        if (touched[static_cast<std::size_t>(wings.left)] != 0 ||
            touched[static_cast<std::size_t>(wings.right)] != 0) {
          continue;
        }
        const int c = opposite(wings.left, edge);
        const int d = opposite(wings.right, edge);
        const Edge flipped = edge_of(c, d);
        if (all.contains(flipped) || made.contains(flipped)) continue;
        if (!rounder(edge.first, edge.second, c, d)) continue;
        faces_[static_cast<std::size_t>(wings.left)] = {c, edge.first, d};
        faces_[static_cast<std::size_t>(wings.right)] = {d, edge.second, c};
        touched[static_cast<std::size_t>(wings.left)] = 1;
        touched[static_cast<std::size_t>(wings.right)] = 1;
        made.insert(flipped);
        any = true;
      }
      if (!any) break;
    }
  }

  /// Whether the edge c-d instead of a-b makes rounder triangles, without folding.
  bool rounder(int a, int b, int c, int d) const {
    const auto cosine = [&](int at, int p, int q) {
      return (point(p) - point(at)).normalized().dot((point(q) - point(at)).normalized());
    };
    // Delaunay: the angles opposite the edge sum to more than 180 deg.
    if (cosine(c, a, b) + cosine(d, a, b) >= -1e-9) return false;
    const auto normal = [&](int p, int q, int r) -> Vector {
      return (point(q) - point(p)).cross(point(r) - point(p));
    };
    const Vector before = normal(a, b, c) + normal(b, a, d);
    const Vector one = normal(c, a, d);
    const Vector two = normal(d, b, c);
    return one.dot(before) > 0.5 * one.norm() * before.norm() &&
           two.dot(before) > 0.5 * two.norm() * before.norm();
  }

  void relax() {
    for (int step = 0; step < 3; ++step) {
      const std::map<Edge, Wings> all = edges();
      const std::vector<char> rim = boundary(all);
      std::vector<Vector> sum(points_.size(), Vector::Zero());
      std::vector<double> weight(points_.size(), 0.0);
      for (const auto& [edge, wings] : all) {
        const bool on_rim = wings.left < 0 || wings.right < 0;
        for (const auto& [v, other] : {edge, std::pair(edge.second, edge.first)}) {
          // Along a boundary only what lies on it counts.
          if (rim[static_cast<std::size_t>(v)] != 0 && !on_rim) continue;
          sum[static_cast<std::size_t>(v)] += point(other);
          weight[static_cast<std::size_t>(v)] += 1.0;
        }
      }
      for (std::size_t v = 0; v < points_.size(); ++v) {
        if (weight[v] == 0.0) continue;
        const Vector before = points_[v];
        const Vector target = sum[v] / weight[v];
        points_[v] = options_.project(before + 0.6 * (target - before), before);
      }
    }
  }

  void drop_unused() {
    std::vector<int> number(points_.size(), -1);
    std::vector<Vector> kept;
    for (Corners& corners : faces_) {
      for (int& v : corners) {
        int& n = number[static_cast<std::size_t>(v)];
        if (n < 0) {
          n = static_cast<int>(kept.size());
          kept.push_back(point(v));
        }
        v = n;
      }
    }
    points_ = std::move(kept);
  }

  TriangleMesh result() const {
    TriangleMesh mesh;
    mesh.vertices.resize(static_cast<Eigen::Index>(points_.size()), 3);
    for (std::size_t v = 0; v < points_.size(); ++v) {
      mesh.vertices.row(static_cast<Eigen::Index>(v)) = points_[v].transpose();
    }
    mesh.triangles.resize(static_cast<Eigen::Index>(faces_.size()), 3);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      mesh.triangles.row(static_cast<Eigen::Index>(f)) << faces_[f][0], faces_[f][1], faces_[f][2];
    }
    return mesh;
  }

  const RemeshingOptions& options_;
  std::vector<Vector> points_;
  std::vector<Corners> faces_;
};

}  // namespace

TriangleMesh clipped(const TriangleMesh& mesh, const Eigen::Vector3d& normal, double offset,
                     double snap_mm) {
  std::vector<Vector> points;
  std::vector<double> height;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    Vector p = mesh.vertices.row(v);
    double h = p.dot(normal) - offset;
    if (std::abs(h) <= snap_mm) {
      p -= h * normal;
      h = 0.0;
    }
    points.push_back(p);
    height.push_back(h);
  }
  std::map<Edge, int> cuts;
  const auto cut = [&](int a, int b) {
    const auto [place, added] = cuts.try_emplace(edge_of(a, b), static_cast<int>(points.size()));
    if (added) {
      const double ha = height[static_cast<std::size_t>(a)];
      const double hb = height[static_cast<std::size_t>(b)];
      const Vector p = points[static_cast<std::size_t>(a)];
      const Vector q = points[static_cast<std::size_t>(b)];
      const Vector between = p + ha / (ha - hb) * (q - p);
      points.emplace_back(between - (between.dot(normal) - offset) * normal);
    }
    return place->second;
  };
  std::vector<Corners> faces;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    std::vector<int> polygon;
    bool inside = false;
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.triangles(f, i);
      const int b = mesh.triangles(f, (i + 1) % 3);
      const double ha = height[static_cast<std::size_t>(a)];
      const double hb = height[static_cast<std::size_t>(b)];
      if (ha >= 0.0) polygon.push_back(a);
      inside = inside || ha > 0.0;
      if ((ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0)) polygon.push_back(cut(a, b));
    }
    if (!inside) continue;
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      faces.push_back({polygon[0], polygon[i - 1], polygon[i]});
    }
  }
  TriangleMesh result;
  std::vector<int> number(points.size(), -1);
  int count = 0;
  for (Corners& corners : faces) {
    for (int& v : corners) {
      int& n = number[static_cast<std::size_t>(v)];
      if (n < 0) n = count++;
      v = n;
    }
  }
  result.vertices.resize(count, 3);
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (number[v] >= 0) result.vertices.row(number[v]) = points[v].transpose();
  }
  result.triangles.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    result.triangles.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
  return result;
}

TriangleMesh remeshed(const TriangleMesh& mesh, const RemeshingOptions& options) {
  return Remesher(mesh, options).run();
}

}  // namespace skullstation
