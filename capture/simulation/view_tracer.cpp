#include "capture/simulation/view_tracer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random.h"
#include "core/units.h"

namespace skullstation {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Dimensions of a sample, each with a set of points of its own.
enum Dimension : std::uint64_t { in_pixel, in_pupil, in_time, on_first_lamp };

constexpr float gloss_exponent = 24.0F;

/// Unit square to unit disc without bunching (Shirley & Chiu 1997).
Vector2d in_disc(const Eigen::Vector2f& sample) {
  const double a = 2.0 * static_cast<double>(sample.x()) - 1.0;
  const double b = 2.0 * static_cast<double>(sample.y()) - 1.0;
  if (a == 0.0 && b == 0.0) return Vector2d::Zero();
  constexpr double quarter = std::numbers::pi / 4.0;
  const bool wide = std::abs(a) > std::abs(b);
  const double radius = wide ? a : b;
  const double turn = wide ? quarter * (b / a) : 2.0 * quarter - quarter * (a / b);
  return {radius * std::cos(turn), radius * std::sin(turn)};
}

Vector3d about_z(const Vector3d& v, double cosine, double sine) {
  return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y(), v.z()};
}

}  // namespace

ViewTracer::ViewTracer(const PlacedScene& scene, const PreparedOptics& optics,
                       std::span<const double> table_angles_deg, const RenderOptions& options)
    : scene_(scene),
      optics_(optics),
      table_angles_deg_(table_angles_deg.begin(), table_angles_deg.end()),
      options_(options),
      station_from_camera_(optics.optics().camera_from_station.inverse()) {
  moving_ = std::ranges::any_of(table_angles_deg_,
                                [&](double angle) { return angle != table_angles_deg_.front(); });
  still_cos_ = std::cos(radians(table_angles_deg_.front()));
  still_sin_ = std::sin(radians(table_angles_deg_.front()));
  if (scene.table_from_specimen) {
    specimen_from_table_ = scene.table_from_specimen->inverse();
    table_rotation_specimen_ = scene.table_from_specimen->rotation.toRotationMatrix();
  }
}

double ViewTracer::table_angle_deg(double time) const {
  const double at = time * static_cast<double>(table_angles_deg_.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), table_angles_deg_.size() - 2);
  const double share = at - static_cast<double>(i);
  return (1.0 - share) * table_angles_deg_[i] + share * table_angles_deg_[i + 1];
}

ViewTracer::Sight ViewTracer::sight(const PixelSample& sample) const {
  const CameraOptics& optics = optics_.optics();
  Sight sight;
  sight.pixel_hash = mix(options_.seed, static_cast<std::uint64_t>(sample.y) *
                                                static_cast<std::uint64_t>(optics.lens.width) +
                                            static_cast<std::uint64_t>(sample.x));
  const auto draw = [&](Dimension dimension) -> const Eigen::Vector2f& {
    return scene_.parts->samples.at(mix(sight.pixel_hash, dimension), sample.index);
  };
  const Eigen::Vector2f& place = draw(in_pixel);
  const Vector2d chief = optics_.ray(sample.x + static_cast<double>(place.x()),
                                     sample.y + static_cast<double>(place.y()));
  Vector3d origin = Vector3d::Zero();
  Vector3d direction = chief.homogeneous();
  if (optics.aperture_mm > 0.0) {
    // Thin lens: all rays of an image point meet where its chief ray crosses the plane in focus.
    origin.head<2>() = 0.5 * optics.aperture_mm * in_disc(draw(in_pupil));
    direction -= origin / optics.focus_distance_mm;
  }
  const double length = direction.norm();
  const Vector2d here = optics_.ray(sample.x, sample.y);
  const double filter_px = 1.0 / std::sqrt(static_cast<double>(options_.samples));
  const auto change = [&](double dx, double dy) -> Vector3d {
    const Vector2d d = (optics_.ray(sample.x + dx, sample.y + dy) - here) * (filter_px / length);
    return {d.x(), d.y(), 0.0};
  };

  sight.cos_table = still_cos_;
  sight.sin_table = still_sin_;
  if (moving_) {
    const double angle = radians(table_angle_deg(static_cast<double>(draw(in_time).x())));
    sight.cos_table = std::cos(angle);
    sight.sin_table = std::sin(angle);
  }
  const auto to_table = [&](const Vector3d& v) {
    return about_z(v, sight.cos_table, -sight.sin_table);
  };
  const auto turned = [&](const Vector3d& v) {
    return to_table(station_from_camera_.rotation * v);
  };
  sight.ray.origin = to_table(station_from_camera_ * origin);
  sight.ray.direction = turned(direction / length);
  sight.ray.direction_dx = turned(change(1.0, 0.0));
  sight.ray.direction_dy = turned(change(0.0, 1.0));
  return sight;
}

void ViewTracer::add_lamps(const SurfacePoint& point, const Sight& sight, const PixelSample& sample,
                           std::size_t sample_number) {
  const std::vector<SoftBox>& lamps = scene_.parts->options.lights;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const SoftBox& lamp = lamps[i];
    const Vector3d axis = lamp.target_mm - lamp.centre_mm;
    const double reach = axis.norm();
    const Vector3d facing = axis / reach;
    Vector3d across = facing.cross(Vector3d::UnitZ());
    if (across.norm() < 1e-9) across = Vector3d::UnitX();
    across.normalize();
    const Eigen::Vector2f& at =
        scene_.parts->samples.at(mix(sight.pixel_hash, on_first_lamp + i), sample.index);
    const Vector3d on_lamp =
        lamp.centre_mm + (static_cast<double>(at.x()) - 0.5) * lamp.width_mm * across +
        (static_cast<double>(at.y()) - 0.5) * lamp.height_mm * facing.cross(across);
    const Vector3d to_lamp =
        about_z(on_lamp, sight.cos_table, -sight.sin_table) - point.shadow_origin;
    const double distance = to_lamp.norm();
    const Vector3d direction = to_lamp / distance;
    const double cosine = point.normal.dot(direction);
    const double lamp_cosine = -about_z(facing, sight.cos_table, -sight.sin_table).dot(direction);
    if (cosine <= 0.0 || lamp_cosine <= 0.0 || point.flat_normal.dot(direction) <= 0.0) continue;

    // `strength` is what a white diffuser at the target sends back; from there the light falls
    // off with both cosines and the square of the distance.
    const auto light = static_cast<float>(lamp.strength * cosine * lamp_cosine * reach * reach /
                                          (distance * distance));
    Vector3f radiance = light * point.albedo;
    if (point.gloss > 0.0F) {
      // Blinn 1977 with the normalisation of Akenine-Moeller et al. 2018.
      const Vector3d half = (direction - sight.ray.direction).normalized();
      const auto along = static_cast<float>(std::max(0.0, point.normal.dot(half)));
      radiance.array() +=
          light * point.gloss * (gloss_exponent + 8.0F) / 8.0F * std::pow(along, gloss_exponent);
    }
    lamp_lights_.push_back({sample_number, radiance});
    shadow_rays_.push_back({specimen_from_table_ * point.shadow_origin,
                            specimen_from_table_.rotation * direction, distance});
  }
}

void ViewTracer::trace(std::span<const PixelSample> samples, std::span<TracedSample> traced) {
  const bool specimen = scene_.table_from_specimen.has_value();
  sights_.clear();
  points_.clear();
  rays_.clear();
  shadow_rays_.clear();
  lamp_lights_.clear();
  const Eigen::Matrix3d specimen_rotation_table = table_rotation_specimen_.transpose();
  for (const PixelSample& sample : samples) {
    sights_.push_back(sight(sample));
    const SightRay& ray = sights_.back().ray;
    points_.push_back(hit_table(scene_, ray));
    if (specimen) {
      rays_.push_back({specimen_from_table_ * ray.origin, specimen_rotation_table * ray.direction,
                       std::min(points_.back().distance_mm, 1e6)});
    }
  }
  hits_.assign(rays_.size(), {});
  if (specimen) scene_.parts->surface->intersect(rays_, hits_);

  for (std::size_t i = 0; i < samples.size(); ++i) {
    SurfacePoint& point = points_[i];
    if (specimen && hits_[i].triangle >= 0) {
      point = specimen_point(scene_, table_rotation_specimen_, sights_[i].ray, hits_[i]);
    } else {
      color_table(scene_, sights_[i].ray, sights_[i].cos_table, sights_[i].sin_table, point);
    }
    traced[i].object = point.object;
    if (point.object == SceneObject::backdrop) {
      traced[i].radiance = point.albedo;
      continue;
    }
    traced[i].radiance = point.ambient;
    add_lamps(point, sights_[i], samples[i], i);
  }
  blocked_.assign(shadow_rays_.size(), 0);
  if (specimen) scene_.parts->surface->occluded(shadow_rays_, blocked_);
  for (std::size_t i = 0; i < lamp_lights_.size(); ++i) {
    if (!blocked_[i]) traced[lamp_lights_[i].sample_number].radiance += lamp_lights_[i].radiance;
  }
}

}  // namespace skullstation
