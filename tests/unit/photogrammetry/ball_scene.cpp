#include "tests/unit/photogrammetry/ball_scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "core/random.h"
#include "core/units.h"

namespace skullstation {

namespace {

/// Random values at the points of a grid, smoothly between them.
double noise(const Eigen::Vector3d& p) {
  const Eigen::Vector3d low = p.array().floor();
  const Eigen::Vector3d f = p - low;
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::uint64_t hash = 17;
    for (int axis = 0; axis < 3; ++axis) {
      const int bit = corner >> axis & 1;
      weight *= bit != 0 ? f[axis] : 1.0 - f[axis];
      hash =
          mix(hash, static_cast<std::uint64_t>(static_cast<std::int64_t>(low[axis]) + bit + 4096));
    }
    value += weight * (static_cast<double>(hash >> 11) * 0x1.0p-53);
  }
  return value;
}

double texture(const Eigen::Vector3d& p) {
  return 60.0 + 70.0 * noise(p / 6.0) + 60.0 * noise(p / 2.5) + 60.0 * noise(p / 1.2);
}

}  // namespace

double BallScene::depth_mm(const Pinhole& camera, const Rigid3& camera_from_table, double x_px,
                           double y_px) const {
  const Eigen::Vector3d ray = camera.ray(x_px, y_px);
  const Eigen::Vector3d c = camera_from_table * centre_mm;
  const double a = ray.squaredNorm();
  const double b = ray.dot(c);
  const double root = b * b - a * (c.squaredNorm() - radius_mm * radius_mm);
  return root <= 0.0 ? 0.0 : (b - std::sqrt(root)) / a;
}

std::vector<StereoView> photograph(const BallScene& scene) {
  std::vector<StereoView> views;
  for (int v = 0; v < scene.views; ++v) {
    const double azimuth = radians(360.0 * v / scene.views);
    const double elevation = radians(scene.elevation_deg);
    const Eigen::Vector3d back(std::cos(elevation) * std::cos(azimuth),
                               std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    Eigen::Matrix3d rows;
    rows.row(2) = -back;
    rows.row(0) = -back.cross(Eigen::Vector3d::UnitZ()).normalized();
    rows.row(1) = rows.row(2).cross(rows.row(0));
    StereoView view;
    view.name = "ball " + std::to_string(v);
    view.camera = {scene.width,    scene.height,      scene.focal_px,
                   scene.focal_px, 0.5 * scene.width, 0.5 * scene.height};
    view.camera_from_table.rotation = Eigen::Quaterniond(rows);
    view.camera_from_table.translation = -(rows * (scene.centre_mm + scene.distance_mm * back));
    view.color = Image8(scene.width, scene.height, 1);
    view.mask = Image8(scene.width, scene.height, 1);
    const Rigid3 table_from_camera = view.camera_from_table.inverse();
    for (int y = 0; y < scene.height; ++y) {
      for (int x = 0; x < scene.width; ++x) {
        double sum = 0.0;
        int hits = 0;
        for (int ray = 0; ray < 9; ++ray) {
          const double u = x + (ray % 3 + 0.5) / 3.0;
          const double w = y + (ray / 3 + 0.5) / 3.0;
          const double depth = scene.depth_mm(view.camera, view.camera_from_table, u, w);
          if (depth == 0.0) continue;
          sum += texture(table_from_camera * (depth * view.camera.ray(u, w)));
          ++hits;
        }
        view.color.at(x, y) = static_cast<std::uint8_t>(std::lround(sum / 9.0));
        view.mask.at(x, y) = static_cast<std::uint8_t>(255 * hits / 9);
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<DepthMap> true_depth_maps(const BallScene& scene, std::span<const StereoView> views) {
  std::vector<DepthMap> maps;
  for (const StereoView& view : views) {
    DepthMap map{view.camera, view.camera_from_table, view.pass, {}, {}, {}, {}};
    const std::size_t pixels = view.mask.pixels.size();
    map.planes.resize(pixels);
    map.agreement.assign(pixels, 8);
    map.cost.assign(pixels, 0.0f);
    const auto inverse_depth = [&](double x, double y) {
      const double depth = scene.depth_mm(view.camera, view.camera_from_table, x, y);
      return depth == 0.0 ? 0.0 : 1.0 / depth;
    };
    for (int y = 0; y < scene.height; ++y) {
      for (int x = 0; x < scene.width; ++x) {
        const double here = inverse_depth(x + 0.5, y + 0.5);
        const double right = inverse_depth(x + 0.6, y + 0.5);
        const double below = inverse_depth(x + 0.5, y + 0.6);
        if (here == 0.0 || right == 0.0 || below == 0.0) continue;
        map.planes[map.index(x, y)] = {static_cast<float>(here),
                                       static_cast<float>((right - here) / 0.1),
                                       static_cast<float>((below - here) / 0.1)};
      }
    }
    maps.push_back(std::move(map));
  }
  return maps;
}

}  // namespace skullstation
