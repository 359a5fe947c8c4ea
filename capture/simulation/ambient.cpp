#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/simulation/placed_scene.h"
#include "core/parallel.h"
#include "core/random.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Reflected by the board and the platter where the light falls on them freely.
constexpr float table_bounce = 0.40F;
/// Reflected from one part of the specimen to another.
constexpr float bone_bounce = 0.16F;
/// The dark room below the table.
constexpr float below = 0.02F;
/// From the surface, so that a ray doesn't hit where it begins.
constexpr double offset_mm = 0.05;
constexpr int points_at_once = 64;

/// Cosine-weighted direction around a normal, from a point of the unit square (Malley's method).
Vector3d cosine_direction(const Vector3d& normal, const Eigen::Vector2f& sample) {
  const double radius = std::sqrt(static_cast<double>(sample.x()));
  const double turn = 2.0 * std::numbers::pi * static_cast<double>(sample.y());
  const Vector3d tangent = normal.unitOrthogonal();
  const Vector3d direction = radius * std::cos(turn) * tangent +
                             radius * std::sin(turn) * normal.cross(tangent) +
                             std::sqrt(1.0 - radius * radius) * normal;
  return direction.normalized();
}

/// Calls `give(point, ray, blocked)` for the rays of points [first, last), whose place and normal
/// in specimen coordinates `point_at` tells.
template <class PointAt, class Give>
void cast(const SceneParts& parts, int first, int last, std::uint64_t seed, const PointAt& point_at,
          const Give& give) {
  const int rays_per_point = parts.options.ambient_rays;
  std::vector<SpecimenRay> rays;
  rays.reserve(static_cast<std::size_t>(last - first) * rays_per_point);
  for (int point = first; point < last; ++point) {
    const auto [place, normal] = point_at(point);
    const std::uint64_t set = mix(seed, static_cast<std::uint64_t>(point));
    for (int i = 0; i < rays_per_point; ++i) {
      rays.push_back(
          {place + offset_mm * normal, cosine_direction(normal, parts.samples.at(set, i)), 1e6});
    }
  }
  std::vector<std::uint8_t> blocked(rays.size());
  parts.surface->occluded(rays, blocked);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    give(first + static_cast<int>(i) / rays_per_point, rays[i], blocked[i] != 0);
  }
}

void compute_table_sky(PlacedScene& scene, const Rigid3& specimen_from_table, int threads) {
  const SceneParts& parts = *scene.parts;
  constexpr int size = TableMap::size;
  std::vector<float> open(static_cast<std::size_t>(size) * size, 0.0F);
  const Vector3d up = specimen_from_table.rotation * Vector3d::UnitZ();
  parallel_for(size, threads, [&](int row) {
    const auto point_at = [&](int column) {
      const Vector3d x_table(TableMap::place_mm(column), TableMap::place_mm(row), 0.0);
      return std::pair{specimen_from_table * x_table, up};
    };
    float* open_row = open.data() + static_cast<std::size_t>(row) * size;
    cast(parts, 0, size, mix(parts.options.bone.seed, static_cast<std::uint64_t>(row)), point_at,
         [&](int column, const SpecimenRay&, bool blocked) {
           if (!blocked) open_row[column] += 1.0F / static_cast<float>(parts.options.ambient_rays);
         });
  });
  scene.table_sky = TableMap(std::move(open)).smoothed();
}

void compute_vertex_ambient(PlacedScene& scene, int threads) {
  const SceneParts& parts = *scene.parts;
  const ShadingMesh& mesh = parts.surface->mesh();
  const int vertices = static_cast<int>(mesh.vertices.rows());
  const Rigid3& table_from_specimen = *scene.table_from_specimen;
  const Eigen::Matrix3d table_rotation = table_from_specimen.rotation.toRotationMatrix();
  const float weight = 1.0F / static_cast<float>(parts.options.ambient_rays);
  scene.vertex_ambient.assign(static_cast<std::size_t>(vertices), {});
  const auto point_at = [&](int v) {
    return std::pair{Vector3d(mesh.vertices.row(v)),
                     Vector3d(mesh.vertex_normals[static_cast<std::size_t>(v)].cast<double>())};
  };
  const auto give = [&](int v, const SpecimenRay& ray, bool blocked) {
    Ambient& ambient = scene.vertex_ambient[static_cast<std::size_t>(v)];
    if (blocked) {
      ambient.from_bone += weight * bone_bounce;
      return;
    }
    const Vector3d direction = table_rotation * ray.direction;
    if (direction.z() >= 0.0) {
      ambient.neutral += weight * sky_radiance(parts.options, direction.z());
      return;
    }
    const Vector3d from = table_from_specimen * ray.origin;
    const Vector3d on_table = from - direction * (from.z() / direction.z());
    const bool on_platter = on_table.head<2>().norm() < parts.options.platter_radius_mm;
    ambient.neutral +=
        weight *
        (on_platter ? table_bounce * scene.table_sky.at(on_table.x(), on_table.y()) : below);
  };
  parallel_for((vertices + points_at_once - 1) / points_at_once, threads, [&](int block) {
    const int first = block * points_at_once;
    cast(parts, first, std::min(vertices, first + points_at_once), mix(parts.options.bone.seed, 7),
         point_at, give);
  });
}

}  // namespace

float sky_radiance(const SceneOptions& options, double direction_z) {
  return static_cast<float>(options.ambient * (1.0 + 2.0 * std::max(0.0, direction_z)) / 3.0);
}

float open_ambient(const SceneOptions& options, double normal_z) {
  // The cosine-weighted mean of sky_radiance over the hemisphere around a normal that points up is
  // 7/9 of the zenith's; a tilted surface sees the dark below with the rest.
  const double above = 0.5 * (1.0 + normal_z);
  return static_cast<float>(above * options.ambient * 7.0 / 9.0) +
         static_cast<float>(1.0 - above) * below;
}

void compute_ambient(PlacedScene& scene, int threads) {
  scene.vertex_ambient.clear();
  scene.table_sky = {};
  if (!scene.parts->surface || !scene.table_from_specimen) return;
  compute_table_sky(scene, scene.table_from_specimen->inverse(), threads);
  compute_vertex_ambient(scene, threads);
}

}  // namespace skullstation
