#include "reconstruction/rendering/outside.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/parallel.h"
#include "reconstruction/rendering/ray_scene.h"

namespace skullstation {

namespace {
constexpr int kDirections = 400;
constexpr int kChunk = 128;
constexpr double kLeastShare = 0.08;
/// Starts off the surface, whose triangles are flatter than the bone.
constexpr double kLift_mm = 0.3;
constexpr double kFar_mm = 1e4;

/// A spiral of points evenly over the sphere.
std::vector<Eigen::Vector3d> spiral(int count) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double turn = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return directions;
}

}  // namespace

std::vector<bool> outside_vertices(const TriangleMesh& mesh, int threads) {
  std::vector<int> all(static_cast<std::size_t>(mesh.vertices.rows()));
  std::iota(all.begin(), all.end(), 0);
  return outside_vertices(mesh, all, kDirections, threads);
}

std::vector<bool> outside_vertices(const TriangleMesh& mesh, std::span<const int> vertices,
                                   int directions, int threads) {
  const std::vector<Eigen::Vector3d> all_directions = spiral(directions);
  const std::array<const TriangleMesh*, 1> meshes{&mesh};
  const RayScene scene(meshes);
  const auto is_outside = [&](int v) {
    const Eigen::Vector3d normal = mesh.normals.row(v);
    const Eigen::Vector3d origin = mesh.vertices.row(v).transpose() + kLift_mm * normal;
    double open = 0.0;
    double all = 0.0;
    for (const Eigen::Vector3d& direction : all_directions) {
      const double cosine = direction.dot(normal);
      if (cosine <= 0.05) continue;
      all += cosine;
      if (!scene.blocked(origin, direction, kFar_mm)) open += cosine;
    }
    return open >= kLeastShare * all && all > 0.0;
  };
  const auto count = static_cast<int>(vertices.size());
  std::vector<char> seen(vertices.size(), 0);
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      const auto at = static_cast<std::size_t>(i);
      seen[at] = is_outside(vertices[at]);
    }
  });
  return {seen.begin(), seen.end()};
}

}  // namespace skullstation
