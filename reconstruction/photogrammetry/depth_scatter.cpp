#include "reconstruction/photogrammetry/depth_scatter.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/median.h"
#include "core/parallel.h"
#include "core/units.h"

namespace skullstation {

namespace {

constexpr int kBatch = 4096;
/// A normal distribution's standard deviation for a median absolute deviation of 1.
constexpr double kSdPerMedian = 1.4826;
/// The surface's error for a standard deviation of 1 of the views' depths about it.
constexpr double kErrorPerScatter = 2.0;

/// From the point along its normal to what the map holds there; nothing where it doesn't look at
/// that side of the surface or holds no depth.
std::optional<double> distance_mm(const DepthMap& map, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& normal) {
  static const double least_cosine = std::cos(radians(80.0));
  const Eigen::Vector3d x_camera = map.camera_from_table * point;
  const Eigen::Vector3d n_camera = map.camera_from_table.rotation * normal;
  const double along_normal = x_camera.dot(n_camera);
  if (x_camera.z() <= 1.0 || -along_normal < least_cosine * x_camera.norm()) return std::nullopt;
  const Eigen::Vector2d pixel = map.camera.project(x_camera);
  const auto column = static_cast<int>(std::floor(pixel.x()));
  const auto row = static_cast<int>(std::floor(pixel.y()));
  if (column < 0 || row < 0 || column >= map.camera.width || row >= map.camera.height) {
    return std::nullopt;
  }
  const InversePlane& plane = map.planes[map.index(column, row)];
  if (plane.w == 0.0f) return std::nullopt;
  const double w = plane.at(static_cast<float>(pixel.x() - column - 0.5),
                            static_cast<float>(pixel.y() - row - 0.5));
  if (w <= 0.0) return std::nullopt;
  return (1.0 / (w * x_camera.z()) - 1.0) * along_normal;
}

}  // namespace

std::vector<float> depth_scatter(const TriangleMesh& mesh, std::span<const DepthMap> maps,
                                 double reach_mm, int threads) {
  const auto count = static_cast<int>(mesh.vertices.rows());
  std::vector<float> scatter(static_cast<std::size_t>(count), 0.0f);
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    std::vector<double> distances;
    for (int v = batch * kBatch; v < std::min(count, (batch + 1) * kBatch); ++v) {
      distances.clear();
      for (const DepthMap& map : maps) {
        const auto distance = distance_mm(map, mesh.vertices.row(v), mesh.normals.row(v));
        if (distance && std::abs(*distance) <= reach_mm) distances.push_back(std::abs(*distance));
      }
      if (distances.size() < 2) continue;
      scatter[static_cast<std::size_t>(v)] =
          static_cast<float>(kErrorPerScatter * kSdPerMedian * median(distances));
    }
  });
  return scatter;
}

}  // namespace skullstation
