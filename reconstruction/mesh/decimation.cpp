#include "reconstruction/mesh/decimation.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

namespace skullstation {

namespace {

/// Edges shorter than this share of the wanted mean are collapsed; what is left is then on average
/// as long as wanted (measured on spheres and heads).
constexpr double collapse_share = 0.68;
/// No edge grows beyond this multiple of the wanted mean.
constexpr double longest_share = 1.7;
constexpr int rounds = 8;
constexpr int most_triangles_round_vertex = 12;
/// Pull towards the edge's middle, relative to the planes' own stiffness: settles where the planes
/// leave a vertex free to slide.
constexpr double middle_weight = 1e-2;
/// A triangle may turn by less than acos of this in one collapse.
constexpr double least_turn_cosine = 0.3;

/// Sum of squared distances to weighted planes, about an origin near the mesh.
struct Quadric {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0.0;
  double weight = 0.0;

  void add_plane(const Eigen::Vector3d& normal, double offset, double plane_weight) {
    a += plane_weight * normal * normal.transpose();
    b += plane_weight * offset * normal;
    c += plane_weight * offset * offset;
    weight += plane_weight;
  }
  void add(const Quadric& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    weight += other.weight;
  }
  double squared_distance(const Eigen::Vector3d& x) const {
    return weight > 0.0 ? std::max(0.0, (x.dot(a * x) - 2.0 * b.dot(x) + c) / weight) : 0.0;
  }
  /// Where it is least, held to `middle`.
  Eigen::Vector3d best_place(const Eigen::Vector3d& middle) const {
    const double hold = middle_weight * a.trace() + 1e-12;
    const Eigen::Matrix3d held = a + hold * Eigen::Matrix3d::Identity();
    return held.ldlt().solve(b + hold * middle);
  }
};

class Decimator {
 public:
  Decimator(const TriangleMesh& mesh, const DecimationOptions& options) : options_(options) {
    const auto vertex_count = static_cast<std::size_t>(mesh.vertices.rows());
    if (vertex_count > 0) origin_ = mesh.vertices.row(0);
    vertices_.resize(vertex_count);
    for (std::size_t v = 0; v < vertex_count; ++v) {
      vertices_[v].place = mesh.vertices.row(static_cast<Eigen::Index>(v)).transpose() - origin_;
    }
    triangles_.resize(static_cast<std::size_t>(mesh.triangles.rows()));
    next_.resize(3 * triangles_.size(), -1);
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        triangles_[f][c] = mesh.triangles(static_cast<Eigen::Index>(f), static_cast<int>(c));
      }
    }
    link_corners();
    add_planes();
    lock_boundary();
    seen_.resize(vertex_count, 0);
    touched_.resize(vertex_count, 0);
  }

  void run() {
    const double end_mm = collapse_share * options_.edge_mm;
    for (int round = 1; round <= rounds; ++round) {
      const double limit_mm = end_mm * round / rounds;
      // Repeated while it pays: a vertex takes part once in each sweep.
      const std::size_t worth_while = round < rounds ? 50 : 1000;
      for (int sweep = 0; sweep < 12; ++sweep) {
        ++sweep_;
        const std::size_t collapsed = collapse_shorter_than(limit_mm);
        if (collapsed * worth_while < left_.size()) break;
      }
    }
  }

  TriangleMesh result() const {
    std::vector<int> number(vertices_.size(), -1);
    std::vector<std::size_t> kept;
    std::vector<std::size_t> order;
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      if (triangles_[f][0] < 0) continue;
      kept.push_back(f);
      for (const int v : triangles_[f]) number[at(v)] = 0;
    }
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] < 0) continue;
      number[v] = static_cast<int>(order.size());
      order.push_back(v);
    }
    TriangleMesh mesh;
    mesh.vertices.resize(std::ssize(order), 3);
    for (std::size_t i = 0; i < order.size(); ++i) {
      mesh.vertices.row(static_cast<Eigen::Index>(i)) = vertices_[order[i]].place + origin_;
    }
    mesh.triangles.resize(std::ssize(kept), 3);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        mesh.triangles(static_cast<Eigen::Index>(i), static_cast<int>(c)) =
            number[at(triangles_[kept[i]][c])];
      }
    }
    return mesh;
  }

 private:
  struct Vertex {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Quadric quadric;
    int first_corner = -1;  ///< 3 * triangle + corner; the next one in next_
    bool locked = false;
  };

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  Vertex& vertex(int v) { return vertices_[at(v)]; }
  const Vertex& vertex(int v) const { return vertices_[at(v)]; }
  const Eigen::Vector3d& place(int v) const { return vertices_[at(v)].place; }
  bool is_alive(int corner) const { return triangles_[at(corner / 3)][0] >= 0; }

  void link_corners() {
    left_.resize(triangles_.size());
    std::iota(left_.begin(), left_.end(), 0);
    for (int corner = static_cast<int>(next_.size()) - 1; corner >= 0; --corner) {
      Vertex& owner = vertex(triangles_[at(corner / 3)][at(corner % 3)]);
      next_[at(corner)] = owner.first_corner;
      owner.first_corner = corner;
    }
  }

  /// Calls `work(corner)` for the vertex's corners in triangles that are left, and forgets others.
  template <class Work>
  void for_corners(int v, const Work& work) {
    int* link = &vertex(v).first_corner;
    while (*link >= 0) {
      const int corner = *link;
      if (!is_alive(corner)) {
        *link = next_[at(corner)];
        continue;
      }
      work(corner);
      link = &next_[at(corner)];
    }
  }

  Eigen::Vector3d doubled_area_normal(const std::array<int, 3>& t) const {
    return (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]));
  }

  void add_planes() {
    for (const auto& t : triangles_) {
      const Eigen::Vector3d normal = doubled_area_normal(t);
      const double doubled_area = normal.norm();
      if (!(doubled_area > 0.0)) continue;
      const Eigen::Vector3d unit = normal / doubled_area;
      for (const int v : t) {
        vertex(v).quadric.add_plane(unit, unit.dot(place(t[0])), doubled_area / 6.0);
      }
    }
  }

  /// A vertex of n triangles with other than n neighbours lies on a boundary or is no manifold's.
  void lock_boundary() {
    std::vector<int> around;
    for (int v = 0; v < static_cast<int>(vertices_.size()); ++v) {
      around.clear();
      std::size_t corners = 0;
      for_corners(v, [&](int corner) {
        ++corners;
        for (const int other : triangles_[at(corner / 3)]) {
          if (other != v) around.push_back(other);
        }
      });
      std::ranges::sort(around);
      around.erase(std::unique(around.begin(), around.end()), around.end());
      vertex(v).locked = around.size() != corners;
    }
  }

  std::size_t collapse_shorter_than(double limit_mm) {
    std::size_t collapsed = 0;
    std::erase_if(left_, [&](int f) { return triangles_[at(f)][0] < 0; });
    for (const int f : left_) {
      const auto t = triangles_[at(f)];
      if (t[0] < 0) continue;
      // The shortest side alone: the others get their turn from their other triangle or later.
      int shortest = 0;
      double least = 1e300;
      for (int side = 0; side < 3; ++side) {
        const double squared = (place(t[at(side)]) - place(t[at((side + 1) % 3)])).squaredNorm();
        if (squared < least) {
          least = squared;
          shortest = side;
        }
      }
      if (least >= limit_mm * limit_mm) continue;
      const int u = t[at(shortest)];
      const int v = t[at((shortest + 1) % 3)];
      if (touched_[at(u)] == sweep_ || touched_[at(v)] == sweep_) continue;
      if (collapse(u, v)) ++collapsed;
    }
    return collapsed;
  }

  bool collapse(int u, int v) {
    if (vertex(u).locked || vertex(v).locked || !link_condition(u, v)) return false;
    Quadric sum = vertex(u).quadric;
    sum.add(vertex(v).quadric);
    const Eigen::Vector3d middle = 0.5 * (place(u) + place(v));
    std::optional<Eigen::Vector3d> target = sum.best_place(middle);
    if ((*target - middle).squaredNorm() > (place(u) - place(v)).squaredNorm() ||
        !is_allowed(u, v, *target)) {
      target = middle;
      if (!is_allowed(u, v, middle)) return false;
    }
    const double most = options_.max_error_mm * options_.max_error_mm;
    if (sum.squared_distance(*target) > most) return false;
    merge(u, v, *target, sum);
    return true;
  }

  /// u and v share exactly the two vertices opposite their edge.
  bool link_condition(int u, int v) {
    ++mark_;
    int corners_u = 0;
    for_corners(u, [&](int corner) {
      ++corners_u;
      for (const int other : triangles_[at(corner / 3)]) seen_[at(other)] = mark_;
    });
    seen_[at(u)] = seen_[at(v)] = 0;
    int shared = 0;
    int corners_v = 0;
    for_corners(v, [&](int corner) {
      ++corners_v;
      for (const int other : triangles_[at(corner / 3)]) {
        if (seen_[at(other)] != mark_) continue;
        seen_[at(other)] = 0;
        ++shared;
      }
    });
    // Two triangles round the vertex that is left would lie on each other.
    const int corners_left = corners_u + corners_v - 4;
    return shared == 2 && corners_left >= 3 && corners_left <= most_triangles_round_vertex;
  }

  bool is_allowed(int u, int v, const Eigen::Vector3d& target) {
    const double longest_mm = longest_share * options_.edge_mm;
    bool allowed = true;
    const auto check = [&](int moving, int gone) {
      for_corners(moving, [&](int corner) {
        const auto& t = triangles_[at(corner / 3)];
        if (!allowed || t[0] == gone || t[1] == gone || t[2] == gone) return;
        const int c = corner % 3;
        const Eigen::Vector3d& second = place(t[at((c + 1) % 3)]);
        const Eigen::Vector3d& third = place(t[at((c + 2) % 3)]);
        const Eigen::Vector3d before = (second - place(moving)).cross(third - place(moving));
        const Eigen::Vector3d after = (second - target).cross(third - target);
        const double old_mm =
            std::max((second - place(moving)).norm(), (third - place(moving)).norm());
        const double new_mm = std::max((second - target).norm(), (third - target).norm());
        const double lengths = before.norm() * after.norm();
        const double base_mm = (third - second).norm();
        allowed = (new_mm <= longest_mm || new_mm <= old_mm) &&
                  (before.dot(after) > least_turn_cosine * lengths || before.norm() < 1e-9) &&
                  after.norm() > 0.02 * base_mm * new_mm;
      });
    };
    check(u, v);
    check(v, u);
    return allowed;
  }

  void merge(int u, int v, const Eigen::Vector3d& target, const Quadric& sum) {
    touched_[at(u)] = sweep_;
    for_corners(v, [&](int corner) {
      auto& t = triangles_[at(corner / 3)];
      if (t[0] == u || t[1] == u || t[2] == u) {
        t = {-1, -1, -1};
      } else {
        t[at(corner % 3)] = u;
      }
    });
    // v's corners are u's now: hang them on.
    int last = -1;
    for_corners(v, [&](int corner) { last = corner; });
    if (last >= 0) {
      next_[at(last)] = vertex(u).first_corner;
      vertex(u).first_corner = vertex(v).first_corner;
    }
    vertex(v).first_corner = -1;
    vertex(u).place = target;
    vertex(u).quadric = sum;
  }

  DecimationOptions options_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<Vertex> vertices_;
  std::vector<std::array<int, 3>> triangles_;  // removed ones hold -1
  std::vector<int> next_;                      // linked lists of each vertex's corners
  std::vector<int> seen_;
  std::vector<int> touched_;  // the sweep in which a vertex last took part
  int mark_ = 0;
  int sweep_ = 0;
  std::vector<int> left_;  // triangles that may be left, in order
};

}  // namespace

Result<void> DecimationOptions::validate() const {
  const auto bad = [](const char* what) { return fail(ErrorKind::usage, "decimation", what); };
  if (!(edge_mm > 0.0)) return bad("edge_mm must be positive");
  if (!(max_error_mm > 0.0)) return bad("max_error_mm must be positive");
  return {};
}

TriangleMesh decimated(const TriangleMesh& mesh, const DecimationOptions& options) {
  Decimator decimator(mesh, options);
  decimator.run();
  return decimator.result();
}

}  // namespace skullstation
