#include "reconstruction/templates/outside.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "reconstruction/rendering/ray_scene.h"

namespace skullstation {

namespace {
constexpr int kDirections = 400;
constexpr double kLeastShare = 0.08;
/// Starts off the surface, whose triangles are flatter than the bone.
constexpr double kLift_mm = 0.3;
constexpr double kFar_mm = 1e4;
}  // namespace

std::vector<bool> outside_vertices(const TriangleMesh& mesh, int threads) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < kDirections; ++i) {  // a spiral of points evenly over the sphere
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
    const double turn = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  const std::array<const TriangleMesh*, 1> meshes{&mesh};
  const RayScene scene(meshes);
  const auto count = static_cast<int>(mesh.vertices.rows());
  std::vector<char> seen(static_cast<std::size_t>(count), 0);
  parallel_for(count, threads, [&](int v) {
    const Eigen::Vector3d normal = mesh.normals.row(v);
    const Eigen::Vector3d origin = mesh.vertices.row(v).transpose() + kLift_mm * normal;
    double open = 0.0;
    double all = 0.0;
    for (const Eigen::Vector3d& direction : directions) {
      const double cosine = direction.dot(normal);
      if (cosine <= 0.05) continue;
      all += cosine;
      if (!scene.blocked(origin, direction, kFar_mm)) open += cosine;
    }
    seen[static_cast<std::size_t>(v)] = open >= kLeastShare * all && all > 0.0;
  });
  return {seen.begin(), seen.end()};
}

}  // namespace skullstation
