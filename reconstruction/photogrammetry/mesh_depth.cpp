#include "reconstruction/photogrammetry/mesh_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace skullstation {

ImageF rendered_inverse_depth(const TriangleMesh& mesh, const Pinhole& camera,
                              const Rigid3& camera_from_table) {
  // Image point and inverse depth, which is linear over a triangle's image.
  std::vector<Eigen::Vector3f> projected(mesh.vertices.rows());
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d x_camera = camera_from_table * mesh.vertices.row(v).transpose();
    const Eigen::Vector2d p = camera.project(x_camera);
    projected[v] = x_camera.z() <= 1.0 ? Eigen::Vector3f::Zero()
                                       : Eigen::Vector3f(p.x(), p.y(), 1.0 / x_camera.z()).eval();
  }
  ImageF depth(camera.width, camera.height, 1, 0.0f);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::Vector3f& a = projected[mesh.triangles(f, 0)];
    const Eigen::Vector3f& b = projected[mesh.triangles(f, 1)];
    const Eigen::Vector3f& c = projected[mesh.triangles(f, 2)];
    if (a.z() == 0.0f || b.z() == 0.0f || c.z() == 0.0f) continue;
    const auto first = [](float px) { return static_cast<int>(std::ceil(px - 0.5f)); };
    const auto last = [](float px) { return static_cast<int>(std::floor(px - 0.5f)); };
    const auto [least_x, most_x] = std::minmax({a.x(), b.x(), c.x()});
    const auto [least_y, most_y] = std::minmax({a.y(), b.y(), c.y()});
    if (most_x < 0.0f || most_y < 0.0f || least_x > static_cast<float>(camera.width) ||
        least_y > static_cast<float>(camera.height)) {
      continue;
    }
    const int left = std::max(first(least_x), 0);
    const int right = std::min(last(most_x), camera.width - 1);
    const int top = std::max(first(least_y), 0);
    const int bottom = std::min(last(most_y), camera.height - 1);
    const float area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (area == 0.0f) continue;
    for (int y = top; y <= bottom; ++y) {
      const float v = static_cast<float>(y) + 0.5f;
      for (int x = left; x <= right; ++x) {
        const float u = static_cast<float>(x) + 0.5f;
        const float to_b = ((u - a.x()) * (c.y() - a.y()) - (v - a.y()) * (c.x() - a.x())) / area;
        const float to_c = ((b.x() - a.x()) * (v - a.y()) - (b.y() - a.y()) * (u - a.x())) / area;
        if (to_b < 0.0f || to_c < 0.0f || to_b + to_c > 1.0f) continue;
        const float w = a.z() + to_b * (b.z() - a.z()) + to_c * (c.z() - a.z());
        depth.at(x, y) = std::max(depth.at(x, y), w);
      }
    }
  }
  return depth;
}

}  // namespace skullstation
