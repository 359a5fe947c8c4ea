#include "reconstruction/statistics/tissue_thickness.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {

namespace {

/// Where a mesh ends: a closest point there says nothing of the depth.
class MeshBoundary {
 public:
  explicit MeshBoundary(const TriangleMesh& mesh)
      : triangles_(mesh.triangles),
        edges_(boundary_edges(mesh.triangles)),
        vertices_(boundary_vertices(mesh.triangles, mesh.vertices.rows())) {}

  bool has(const ClosestPoint& point) const {
    const int feature = static_cast<int>(point.feature);
    switch (point.feature) {
      case TriangleFeature::corner0:
      case TriangleFeature::corner1:
      case TriangleFeature::corner2:
        return vertices_[static_cast<std::size_t>(
            triangles_(point.triangle, feature - static_cast<int>(TriangleFeature::corner0)))];
      case TriangleFeature::edge0:
      case TriangleFeature::edge1:
      case TriangleFeature::edge2:
        return edges_[static_cast<std::size_t>(point.triangle)]
                     [static_cast<std::size_t>(feature - static_cast<int>(TriangleFeature::edge0))];
      case TriangleFeature::face: return false;
    }
    return false;
  }

 private:
  Triangles triangles_;
  std::vector<std::array<bool, 3>> edges_;
  std::vector<bool> vertices_;
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
