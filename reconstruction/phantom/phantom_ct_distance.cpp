#include "reconstruction/phantom/phantom_ct_distance.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/parallel.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

/// Rows of voxels run a hair beside their centres, lest one meets a vertex or an edge exactly.
constexpr double kHair_mm = 1.37e-7;

/// Squared distance of a point from the triangle a, b, c (Ericson 2005, section 5.1.5).
struct TriangleDistance {
  Vector3d a, ab, ac, bc;
  double ab_ab, ab_ac, ac_ac;

  TriangleDistance(const Vector3d& a_, const Vector3d& b, const Vector3d& c)
      : a(a_),
        ab(b - a_),
        ac(c - a_),
        bc(c - b),
        ab_ab(ab.squaredNorm()),
        ab_ac(ab.dot(ac)),
        ac_ac(ac.squaredNorm()) {}

  double squared(const Vector3d& p) const {
    const Vector3d ap = p - a;
    const double d1 = ab.dot(ap);
    const double d2 = ac.dot(ap);
    if (d1 <= 0.0 && d2 <= 0.0) return ap.squaredNorm();
    const double d3 = d1 - ab_ab;
    const double d4 = d2 - ab_ac;
    if (d3 >= 0.0 && d4 <= d3) return (ap - ab).squaredNorm();
    const double d5 = d1 - ab_ac;
    const double d6 = d2 - ac_ac;
    if (d6 >= 0.0 && d5 <= d6) return (ap - ac).squaredNorm();
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return (ap - d1 / (d1 - d3) * ab).squaredNorm();
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return (ap - d2 / (d2 - d6) * ac).squaredNorm();
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
      return (ap - ab - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * bc).squaredNorm();
    }
    const double scale = 1.0 / (va + vb + vc);
    return (ap - vb * scale * ab - vc * scale * ac).squaredNorm();
  }
};

/// Whether every side of a triangle is met by as many sides that run back.
bool is_closed(const Triangles& triangles) {
  std::vector<std::pair<std::uint64_t, int>> sides;
  sides.reserve(static_cast<std::size_t>(triangles.rows()) * 3);
  for (Eigen::Index f = 0; f < triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint64_t>(triangles(f, k));
      const auto b = static_cast<std::uint64_t>(triangles(f, (k + 1) % 3));
      sides.emplace_back(std::min(a, b) << 32U | std::max(a, b), a < b ? 1 : -1);
    }
  }
  std::ranges::sort(sides);
  for (std::size_t i = 0; i < sides.size();) {
    const std::uint64_t side = sides[i].first;
    int balance = 0;
    for (; i < sides.size() && sides[i].first == side; ++i) balance += sides[i].second;
    if (balance != 0) return false;
  }
  return true;
}

bool is_turned_outward(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
    const Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
    const Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
    volume += a.dot(b.cross(c));
  }
  return volume > 0.0;
}

struct Crossing {
  int row;
  double x_mm;
  int turn;  ///< +1: into the solid on the way along +x
};

/// One slice of the grid at a time, in the grid's own axes and millimetres.
class Slices {
 public:
  Slices(const TriangleMesh& mesh, const VoxelGrid& grid, double band_mm)
      : triangles_(mesh.triangles), grid_(grid), band_mm_(band_mm) {
    corners_.resize(mesh.vertices.rows(), 3);
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      corners_.row(v) =
          (grid.direction.transpose() * (mesh.vertices.row(v).transpose() - grid.origin_mm))
              .transpose();
    }
    of_slice_.resize(static_cast<std::size_t>(grid.size.z()));
    for (Eigen::Index f = 0; f < triangles_.rows(); ++f) {
      double low = corners_(triangles_(f, 0), 2);
      double high = low;
      for (int k = 1; k < 3; ++k) {
        low = std::min(low, corners_(triangles_(f, k), 2));
        high = std::max(high, corners_(triangles_(f, k), 2));
      }
      const auto [first, last] = range(low - band_mm, high + band_mm, 2);
      for (int k = first; k <= last; ++k) {
        of_slice_[static_cast<std::size_t>(k)].push_back(static_cast<int>(f));
      }
    }
  }

  /// False if a row never leaves the surface again.
  bool fill(int k, float* distance) const {
    const std::size_t count =
        static_cast<std::size_t>(grid_.size.x()) * static_cast<std::size_t>(grid_.size.y());
    std::fill(distance, distance + count, static_cast<float>(band_mm_ * band_mm_));
    std::vector<Crossing> crossings;
    const double z = k * grid_.spacing_mm.z();
    for (const int f : of_slice_[static_cast<std::size_t>(k)]) {
      near_triangle(f, z, distance);
      cross_triangle(f, z + kHair_mm, crossings);
    }
    for (std::size_t i = 0; i < count; ++i) distance[i] = std::sqrt(distance[i]);
    std::ranges::sort(crossings, [](const Crossing& a, const Crossing& b) {
      return std::pair(a.row, a.x_mm) < std::pair(b.row, b.x_mm);
    });
    for (std::size_t i = 0; i < crossings.size();) {
      const int row = crossings[i].row;
      int inside = 0;
      for (; i < crossings.size() && crossings[i].row == row; ++i) {
        inside += crossings[i].turn;
        if (inside <= 0) continue;
        const bool more = i + 1 < crossings.size() && crossings[i + 1].row == row;
        if (!more) return false;
        float* voxels = distance + static_cast<std::size_t>(row) * grid_.size.x();
        const auto [first, last] = range(crossings[i].x_mm, crossings[i + 1].x_mm, 0);
        for (int x = first; x <= last; ++x) voxels[x] = -voxels[x];
      }
      if (inside != 0) return false;
    }
    return true;
  }

 private:
  /// Voxels along the axis whose centres lie within [low, high].
  std::pair<int, int> range(double low, double high, int axis) const {
    const double spacing = grid_.spacing_mm[axis];
    const int first = static_cast<int>(std::ceil(std::max(low / spacing, 0.0)));
    const int last = static_cast<int>(std::floor(std::min(high / spacing, grid_.size[axis] - 1.0)));
    return {first, last};
  }

  Vector3d corner(int triangle, int k) const {
    return corners_.row(triangles_(triangle, k)).transpose();
  }

  void near_triangle(int f, double z, float* squared) const {
    const Vector3d a = corner(f, 0);
    const Vector3d b = corner(f, 1);
    const Vector3d c = corner(f, 2);
    const TriangleDistance triangle(a, b, c);
    const Vector3d low = a.cwiseMin(b).cwiseMin(c);
    const Vector3d high = a.cwiseMax(b).cwiseMax(c);
    const auto [j0, j1] = range(low.y() - band_mm_, high.y() + band_mm_, 1);
    const auto [i0, i1] = range(low.x() - band_mm_, high.x() + band_mm_, 0);
    const Vector3d normal = triangle.ab.cross(triangle.ac).normalized();
    for (int j = j0; j <= j1; ++j) {
      float* row = squared + static_cast<std::size_t>(j) * grid_.size.x();
      for (int i = i0; i <= i1; ++i) {
        const Vector3d p(i * grid_.spacing_mm.x(), j * grid_.spacing_mm.y(), z);
        const double off_plane = normal.dot(p - a);
        if (off_plane * off_plane >= row[i]) continue;
        row[i] = std::min(row[i], static_cast<float>(triangle.squared(p)));
      }
    }
  }

  void cross_triangle(int f, double z, std::vector<Crossing>& crossings) const {
    const Vector3d a = corner(f, 0);
    const Vector3d b = corner(f, 1);
    const Vector3d c = corner(f, 2);
    if (std::min({a.z(), b.z(), c.z()}) > z || std::max({a.z(), b.z(), c.z()}) < z) return;
    // Seen along x: twice the signed area of the triangle's image in the plane of y and z.
    const double area = (b.y() - a.y()) * (c.z() - a.z()) - (b.z() - a.z()) * (c.y() - a.y());
    if (area == 0.0) return;
    const auto [j0, j1] = range(std::min({a.y(), b.y(), c.y()}) - kHair_mm,
                                std::max({a.y(), b.y(), c.y()}) - kHair_mm, 1);
    for (int j = j0; j <= j1; ++j) {
      const double y = j * grid_.spacing_mm.y() + kHair_mm;
      // The same products for the two triangles of an edge: a row hits one of them, never both.
      const auto beside = [&](const Vector3d& p, const Vector3d& q) {
        const bool forth = std::pair(p.y(), p.z()) < std::pair(q.y(), q.z());
        const Vector3d& s = forth ? p : q;
        const Vector3d& e = forth ? q : p;
        const double side = (e.y() - s.y()) * (z - s.z()) - (e.z() - s.z()) * (y - s.y());
        return forth ? side : -side;
      };
      const double wa = beside(b, c);
      const double wb = beside(c, a);
      const double wc = beside(a, b);
      const bool hit =
          area > 0.0 ? (wa > 0.0 && wb > 0.0 && wc > 0.0) : (wa < 0.0 && wb < 0.0 && wc < 0.0);
      if (!hit) continue;
      const double x = (wa * a.x() + wb * b.x() + wc * c.x()) / (wa + wb + wc);
      // The normal's x component has the sign of the area: against the way we enter.
      crossings.push_back({j, x, area > 0.0 ? -1 : 1});
    }
  }

  const Triangles& triangles_;
  const VoxelGrid& grid_;
  double band_mm_;
  Points3 corners_;
  std::vector<std::vector<int>> of_slice_;
};

}  // namespace

Result<VoxelDistances> voxel_distances(const TriangleMesh& mesh, const VoxelGrid& grid,
                                       double band_mm, int threads) {
  const auto not_closed = [] {
    return fail(ErrorKind::bad_input, "surface for a CT phantom",
                "is not closed or not turned outward");
  };
  if (!is_closed(mesh.triangles) || !is_turned_outward(mesh)) return not_closed();
  VoxelDistances result;
  result.band_mm = band_mm;
  result.distance_mm.resize(grid.count());
  const Slices slices(mesh, grid, band_mm);
  std::atomic<bool> closed = true;
  const std::size_t slice =
      static_cast<std::size_t>(grid.size.x()) * static_cast<std::size_t>(grid.size.y());
  parallel_for(grid.size.z(), threads, [&](int k) {
    if (!slices.fill(k, result.distance_mm.data() + static_cast<std::size_t>(k) * slice)) {
      closed = false;
    }
  });
  // Closed as a whole, yet with a part turned inside out.
  if (!closed) return not_closed();
  return result;
}

}  // namespace skullstation
