#include "capture/simulation/surface_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/simulation/solid_noise.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double shadow_offset_mm = 0.03;
constexpr float paper_albedo = 0.82F;
constexpr float ink_albedo = 0.035F;

struct BoxHit {
  double distance_mm;
  int axis;
};

/// Entry into the box [low, high] (slab method, Kay & Kajiya 1986); nothing if it is missed or
/// begins inside.
std::optional<BoxHit> enter_box(const Vector3d& origin, const Vector3d& direction,
                                const Vector3d& low, const Vector3d& high) {
  double begin = 0.0;
  double end = std::numeric_limits<double>::infinity();
  int axis = -1;
  for (int i = 0; i < 3; ++i) {
    if (direction[i] == 0.0) {
      if (origin[i] < low[i] || origin[i] > high[i]) return std::nullopt;
      continue;
    }
    const double inverse = 1.0 / direction[i];
    double near = (low[i] - origin[i]) * inverse;
    double far = (high[i] - origin[i]) * inverse;
    if (near > far) std::swap(near, far);
    if (near > begin) {
      begin = near;
      axis = i;
    }
    end = std::min(end, far);
    if (begin > end) return std::nullopt;
  }
  if (axis < 0) return std::nullopt;
  return BoxHit{begin, axis};
}

/// The board's plate in the board frame: half width, half height.
Eigen::Vector2d half_plate(const SceneOptions& options) {
  return {0.5 * options.board->width_mm() + options.board_border_mm,
          0.5 * options.board->height_mm() + options.board_border_mm};
}

Vector3d to_board(const PlacedScene& scene, const Vector3d& x_table) {
  return scene.board_rotation_table * (x_table - scene.table_from_board.translation);
}

void hit_board(const PlacedScene& scene, const SightRay& ray, ShadingPoint& nearest) {
  const SceneOptions& options = scene.parts->options;
  const Eigen::Vector2d half = half_plate(options);
  const Vector3d direction = scene.board_rotation_table * ray.direction;
  const auto hit =
      enter_box(to_board(scene, ray.origin), direction,
                {-half.x(), -half.y(), -options.board_thickness_mm}, {half.x(), half.y(), 0.0});
  if (!hit || hit->distance_mm >= nearest.distance_mm) return;
  Vector3d normal = Vector3d::Zero();
  normal[hit->axis] = direction[hit->axis] < 0.0 ? 1.0 : -1.0;
  nearest.object = SceneObject::board;
  nearest.distance_mm = hit->distance_mm;
  nearest.flat_normal = scene.board_rotation_table.transpose() * normal;
}

/// A cylinder around the axis; its top is seen from above, its side from everywhere.
void hit_platter(const SceneOptions& options, const SightRay& ray, ShadingPoint& nearest) {
  const double top = options.board ? -options.board_thickness_mm : 0.0;
  const double radius2 = options.platter_radius_mm * options.platter_radius_mm;
  if (ray.direction.z() < 0.0 && ray.origin.z() > top) {
    const double distance = (top - ray.origin.z()) / ray.direction.z();
    const Vector3d x = ray.origin + distance * ray.direction;
    if (distance < nearest.distance_mm && x.head<2>().squaredNorm() <= radius2) {
      nearest.object = SceneObject::platter;
      nearest.distance_mm = distance;
      nearest.flat_normal = Vector3d::UnitZ();
      return;
    }
  }
  const double a = ray.direction.head<2>().squaredNorm();
  const double b = ray.origin.head<2>().dot(ray.direction.head<2>());
  const double c = ray.origin.head<2>().squaredNorm() - radius2;
  const double discriminant = b * b - a * c;
  if (a == 0.0 || c <= 0.0 || discriminant <= 0.0) return;
  const double distance = (-b - std::sqrt(discriminant)) / a;
  const double z = ray.origin.z() + distance * ray.direction.z();
  if (distance <= 0.0 || distance >= nearest.distance_mm || z > top ||
      z < top - options.platter_thickness_mm) {
    return;
  }
  nearest.object = SceneObject::platter;
  nearest.distance_mm = distance;
  const Vector3d x = ray.origin + distance * ray.direction;
  nearest.flat_normal = Vector3d(x.x(), x.y(), 0.0).normalized();
}

Vector3f backdrop_radiance(const Backdrop& backdrop, const SightRay& ray, double cos_table,
                           double sin_table) {
  const auto to_station = [&](const Vector3d& v) {
    return Vector3d(cos_table * v.x() - sin_table * v.y(), sin_table * v.x() + cos_table * v.y(),
                    v.z());
  };
  const Vector3d origin = to_station(ray.origin);
  const Vector3d direction = to_station(ray.direction);
  const double a = direction.head<2>().squaredNorm();
  const double b = origin.head<2>().dot(direction.head<2>());
  const double c = origin.head<2>().squaredNorm() - Backdrop::radius_mm * Backdrop::radius_mm;
  // From inside there is one hit ahead; straight up or down there is none.
  if (c >= 0.0 || a < 1e-12) return Vector3f::Constant(0.02F);
  const double distance = (-b + std::sqrt(b * b - a * c)) / a;
  return backdrop.radiance(origin + distance * direction);
}

Vector3f board_albedo(const PlacedScene& scene, const SightRay& ray, const ShadingPoint& point) {
  const Vector3d normal = scene.board_rotation_table * point.flat_normal;
  if (normal.z() < 0.5) return Vector3f::Constant(0.35F);  // the plate's sides and back
  // How the point moves on the plane over the width of the filter.
  const double facing = ray.direction.dot(point.flat_normal);
  const auto shift = [&](const Vector3d& change) -> Vector3d {
    return scene.board_rotation_table *
           (point.distance_mm *
            (change - ray.direction * (change.dot(point.flat_normal) / facing)));
  };
  const Vector3d along_x = shift(ray.direction_dx);
  const Vector3d along_y = shift(ray.direction_dy);
  // The upright rectangle with the variance of the parallelogram that the filter covers.
  const double width = std::sqrt(along_x.x() * along_x.x() + along_y.x() * along_y.x()) + 1e-6;
  const double height = std::sqrt(along_x.y() * along_x.y() + along_y.y() * along_y.y()) + 1e-6;
  const Vector3d x_board = to_board(scene, point.x_table);
  const auto white =
      static_cast<float>(scene.parts->print->whiteness(x_board.x(), x_board.y(), width, height));
  return Vector3f::Constant(ink_albedo + white * (paper_albedo - ink_albedo));
}

Vector3f platter_albedo(const ShadingPoint& point, float footprint_mm) {
  const Vector3f x = point.x_table.cast<float>();
  const float grain = 0.10F * gradient_noise(x / 30.0F, 21U) +
                      0.25F * visible_share(1.2F, footprint_mm) * gradient_noise(x / 0.8F, 22U);
  return Vector3f::Constant(0.035F * (1.0F + grain));
}

}  // namespace

ShadingPoint hit_table(const PlacedScene& scene, const SightRay& ray) {
  const SceneOptions& options = scene.parts->options;
  ShadingPoint nearest;
  nearest.distance_mm = std::numeric_limits<double>::infinity();
  if (options.platter) hit_platter(options, ray, nearest);
  if (options.board) hit_board(scene, ray, nearest);
  if (nearest.object == SceneObject::backdrop) return nearest;
  nearest.x_table = ray.origin + nearest.distance_mm * ray.direction;
  nearest.normal = nearest.flat_normal;
  nearest.shadow_origin = nearest.x_table + shadow_offset_mm * nearest.flat_normal;
  return nearest;
}

void color_table(const PlacedScene& scene, const SightRay& ray, double cos_table, double sin_table,
                 ShadingPoint& point) {
  if (point.object == SceneObject::backdrop) {
    point.albedo = backdrop_radiance(scene.parts->backdrop, ray, cos_table, sin_table);
    return;
  }
  const auto footprint = static_cast<float>(
      point.distance_mm * std::max(ray.direction_dx.norm(), ray.direction_dy.norm()));
  point.albedo = point.object == SceneObject::board ? board_albedo(scene, ray, point)
                                                    : platter_albedo(point, footprint);
  float light = open_ambient(scene.parts->options, point.flat_normal.z());
  point.on_table_top = std::abs(point.x_table.z()) < 5.0 && point.flat_normal.z() > 0.9;
  if (point.on_table_top) {
    light *= scene.table_sky.at(point.x_table.x(), point.x_table.y());
  }
  point.ambient = light * point.albedo;
}

ShadingPoint specimen_point(const PlacedScene& scene,
                            const Eigen::Matrix3d& table_rotation_specimen, const SightRay& ray,
                            const SpecimenHit& hit) {
  const SceneParts& parts = *scene.parts;
  const ShadingMesh& mesh = parts.surface->mesh();
  const Eigen::Vector3i corners = mesh.triangles.row(hit.triangle);
  const double weights[3] = {1.0 - hit.b - hit.c, hit.b, hit.c};

  Vector3d vertices[3];
  Vector3d corner_normals[3];
  Vector3d x_specimen = Vector3d::Zero();
  Vector3d normal = Vector3d::Zero();
  Vector3f color = Vector3f::Zero();
  Ambient ambient;
  for (int i = 0; i < 3; ++i) {
    const auto weight = static_cast<float>(weights[i]);
    const auto vertex = static_cast<std::size_t>(corners[i]);
    vertices[i] = mesh.vertices.row(corners[i]);
    corner_normals[i] =
        mesh.corner_normals[3 * static_cast<std::size_t>(hit.triangle) + i].cast<double>();
    x_specimen += weights[i] * vertices[i];
    normal += weights[i] * corner_normals[i];
    if (!mesh.colors.empty()) color += weight * mesh.colors[vertex];
    ambient.neutral += weight * scene.vertex_ambient[vertex].neutral;
    ambient.from_bone += weight * scene.vertex_ambient[vertex].from_bone;
  }
  Vector3d flat = (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]).normalized();
  normal.normalize();

  // Where the smooth surface would be: shadow rays from there don't catch on the facets' edges
  // (J. Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021).
  Vector3d smooth = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double height = std::min(0.0, (x_specimen - vertices[i]).dot(corner_normals[i]));
    smooth += weights[i] * (x_specimen - height * corner_normals[i]);
  }

  ShadingPoint point;
  const Vector3d ray_direction = table_rotation_specimen.transpose() * ray.direction;
  // A surface seen from behind (an open mesh) is lit on the side that is seen.
  if (flat.dot(ray_direction) > 0.0) {
    flat = -flat;
    normal = -normal;
    smooth = x_specimen;
  }
  point.object = SceneObject::specimen;
  point.distance_mm = hit.distance_mm;
  point.x_table = ray.origin + hit.distance_mm * ray.direction;
  point.normal = table_rotation_specimen * normal;
  point.flat_normal = table_rotation_specimen * flat;
  point.shadow_origin =
      point.x_table + table_rotation_specimen * (smooth - x_specimen + shadow_offset_mm * flat);
  const auto footprint = static_cast<float>(
      hit.distance_mm * std::max(ray.direction_dx.norm(), ray.direction_dy.norm()));
  point.albedo = mesh.colors.empty() ? parts.bone.albedo(x_specimen, footprint) : color;
  const Vector3f bone_tint(1.12F, 1.0F, 0.80F);
  point.ambient = point.albedo.cwiseProduct(Vector3f::Constant(ambient.neutral) +
                                            ambient.from_bone * bone_tint);
  point.gloss = static_cast<float>(parts.options.gloss);
  return point;
}

}  // namespace skullstation
