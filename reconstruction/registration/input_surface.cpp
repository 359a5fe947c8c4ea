#include "reconstruction/registration/input_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/units.h"
#include "reconstruction/registration/curvature_measure.h"

namespace skullstation {

namespace {

constexpr int kCandidates = 6;
constexpr double kRidgeShare = 0.3;
constexpr double kRidgeRadius_mm = 6.0;
/// Where the normals differ by this factor times the sine, a candidate counts as farther away.
constexpr double kNormalPenalty_mm = 5.0;

std::vector<bool> triangles_at_holes(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(static_cast<std::size_t>(3 * mesh.triangles.rows()));
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int i = 0; i < 3; ++i) {
      edges.push_back(std::minmax(int{mesh.triangles(f, i)}, int{mesh.triangles(f, (i + 1) % 3)}));
    }
  }
  std::ranges::sort(edges);
  std::vector<bool> vertex(static_cast<std::size_t>(mesh.vertices.rows()), false);
  for (std::size_t e = 0; e < edges.size();) {
    std::size_t next = e + 1;
    while (next < edges.size() && edges[next] == edges[e]) ++next;
    if (next == e + 1) {
      vertex[static_cast<std::size_t>(edges[e].first)] = true;
      vertex[static_cast<std::size_t>(edges[e].second)] = true;
    }
    e = next;
  }
  std::vector<bool> result(static_cast<std::size_t>(mesh.triangles.rows()), false);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int i = 0; i < 3; ++i) {
      if (vertex[static_cast<std::size_t>(mesh.triangles(f, i))]) {
        result[static_cast<std::size_t>(f)] = true;
      }
    }
  }
  return result;
}

OrientedPoints ridges_of(const OrientedPoints& samples, const PointTree& tree, int threads) {
  const Eigen::VectorXd curvature = curvature_measure(samples, tree, kRidgeRadius_mm, threads);
  const double least = upper_quantile(curvature, kRidgeShare);
  OrientedPoints ridges;
  ridges.positions.resize(samples.size(), 3);
  ridges.normals.resize(samples.size(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    if (curvature[i] < least) continue;
    ridges.positions.row(count) = samples.positions.row(i);
    ridges.normals.row(count++) = samples.normals.row(i);
  }
  ridges.positions.conservativeResize(count, 3);
  ridges.normals.conservativeResize(count, 3);
  return ridges;
}

InputHit nearest_of(const OrientedPoints& points, const PointTree& tree,
                    const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                    double max_distance_mm, double max_angle_deg) {
  const double least_cosine = std::cos(radians(max_angle_deg));
  InputHit hit;
  double least = max_distance_mm * max_distance_mm;
  for (const NearPoint& near : tree.nearest(position, kCandidates)) {
    if (near.squared_distance > max_distance_mm * max_distance_mm) break;
    const Eigen::Vector3d other = points.normals.row(near.index);
    const double cosine = other.dot(normal);
    if (cosine < least_cosine) continue;
    const double cost = near.squared_distance + kNormalPenalty_mm * kNormalPenalty_mm *
                                                    std::max(0.0, 1.0 - cosine * cosine);
    if (hit.valid && cost >= least) continue;
    least = cost;
    hit = {true, points.positions.row(near.index), other, std::sqrt(near.squared_distance)};
  }
  return hit;
}

}  // namespace

Result<InputSurface> InputSurface::make(TriangleMesh mesh, double spacing_mm, int threads) {
  auto samples = oriented_samples(mesh, spacing_mm);
  if (!samples) return forward(samples);
  return InputSurface(std::move(mesh), *std::move(samples), threads);
}

InputSurface::InputSurface(TriangleMesh mesh, OrientedPoints samples, int threads)
    : mesh_(std::move(mesh)),
      bvh_(mesh_),
      at_hole_(triangles_at_holes(mesh_)),
      samples_(std::move(samples)),
      sample_tree_(samples_.positions),
      ridges_(ridges_of(samples_, sample_tree_, threads)),
      ridge_tree_(ridges_.positions) {}

InputHit InputSurface::nearest_sample(const Eigen::Vector3d& position,
                                      const Eigen::Vector3d& normal, double max_distance_mm,
                                      double max_angle_deg) const {
  return nearest_of(samples_, sample_tree_, position, normal, max_distance_mm, max_angle_deg);
}

InputHit InputSurface::nearest_ridge(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                                     double max_distance_mm, double max_angle_deg) const {
  return nearest_of(ridges_, ridge_tree_, position, normal, max_distance_mm, max_angle_deg);
}

InputHit InputSurface::nearest_point(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                                     double max_distance_mm, double max_angle_deg) const {
  const ClosestPoint closest = bvh_.closest(position, max_distance_mm);
  if (closest.triangle < 0 || at_hole_[static_cast<std::size_t>(closest.triangle)]) return {};
  const auto corner = [&](int i) -> Eigen::Vector3d {
    return mesh_.vertices.row(mesh_.triangles(closest.triangle, i));
  };
  const Eigen::Vector3d face = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
  if (face.dot(normal) < std::cos(radians(max_angle_deg))) return {};
  return {true, closest.point, face, closest.distance_mm};
}

}  // namespace skullstation
