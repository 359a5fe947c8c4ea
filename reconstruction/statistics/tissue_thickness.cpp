#include "reconstruction/statistics/tissue_thickness.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>

#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/distance/triangle_bvh.h"

namespace skullstation {

namespace {

/// Which edges of each triangle no other triangle shares.
class MeshBoundary {
 public:
  explicit MeshBoundary(const TriangleMesh& mesh)
      : triangles_(mesh.triangles), on_boundary_(mesh.vertices.rows(), false) {
    for (Eigen::Index t = 0; t < triangles_.rows(); ++t) {
      for (int k = 0; k < 3; ++k) ++uses_[key(static_cast<int>(t), k)];
    }
    for (Eigen::Index t = 0; t < triangles_.rows(); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (uses_.at(key(static_cast<int>(t), k)) != 1) continue;
        on_boundary_[triangles_(t, k)] = true;
        on_boundary_[triangles_(t, (k + 1) % 3)] = true;
      }
    }
  }

  bool has(const ClosestPoint& point) const {
    switch (point.feature) {
      case TriangleFeature::corner0:
      case TriangleFeature::corner1:
      case TriangleFeature::corner2:
        return on_boundary_[triangles_(
            point.triangle,
            static_cast<int>(point.feature) - static_cast<int>(TriangleFeature::corner0))];
      case TriangleFeature::edge0:
      case TriangleFeature::edge1:
      case TriangleFeature::edge2:
        return uses_.at(key(point.triangle, static_cast<int>(point.feature) -
                                                static_cast<int>(TriangleFeature::edge0))) == 1;
      case TriangleFeature::face: return false;
    }
    return false;
  }

 private:
  std::uint64_t key(int triangle, int edge) const {
    const auto a = static_cast<std::uint32_t>(triangles_(triangle, edge));
    const auto b = static_cast<std::uint32_t>(triangles_(triangle, (edge + 1) % 3));
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }

  Triangles triangles_;
  std::unordered_map<std::uint64_t, int> uses_;
  std::vector<bool> on_boundary_;
};

tl::unexpected<Error> bad(std::string what) {
  return fail(ErrorKind::bad_input, "tissue thickness", std::move(what));
}

}  // namespace

Result<void> ThicknessOptions::validate() const {
  if (!(max_angle_deg > 0.0 && max_angle_deg <= 90.0)) {
    return bad("max_angle_deg must be above 0, up to 90");
  }
  if (!(max_depth_mm > 0.0)) return bad("max_depth_mm must be positive");
  return {};
}

Result<Eigen::VectorXd> tissue_thickness(const TriangleMesh& skull,
                                         const std::vector<bool>& measurable,
                                         const TriangleMesh& skin,
                                         const ThicknessOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (skin.triangles.rows() == 0) return bad("the skin has no triangles");
  const Eigen::Index count = skull.vertices.rows();
  if (skull.normals.rows() != count || static_cast<Eigen::Index>(measurable.size()) != count) {
    return bad(fmt::format("{} vertices, {} normals and {} flags of the skull", count,
                           skull.normals.rows(), measurable.size()));
  }
  const TriangleBvh tree(skin);
  const MeshBoundary boundary(skin);
  const double least_cosine = std::cos(radians(options.max_angle_deg));
  Eigen::VectorXd thickness =
      Eigen::VectorXd::Constant(count, std::numeric_limits<double>::quiet_NaN());
  constexpr Eigen::Index block = 512;
  const auto blocks = static_cast<int>((count + block - 1) / block);
  parallel_for(blocks, options.threads, [&](int b) {
    const Eigen::Index end = std::min(count, (b + 1) * block);
    for (Eigen::Index v = b * block; v < end; ++v) {
      if (!measurable[static_cast<std::size_t>(v)]) continue;
      const Eigen::Vector3d from = skull.vertices.row(v);
      const ClosestPoint closest = tree.closest(from, options.max_depth_mm);
      if (closest.triangle < 0 || boundary.has(closest)) continue;
      const Eigen::Vector3d way = closest.point - from;
      if (way.dot(skull.normals.row(v)) < least_cosine * closest.distance_mm) continue;
      thickness[v] = closest.distance_mm;
    }
  });
  return thickness;
}

}  // namespace skullstation
