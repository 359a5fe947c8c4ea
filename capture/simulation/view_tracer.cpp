#include "capture/simulation/view_tracer.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/units.h"

namespace skullstation {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Dimensions of a sample, each with a set of points of its own.
enum Dimension : std::uint64_t { in_pupil, in_time, on_first_lamp };

constexpr float gloss_exponent = 24.0F;

/// Where in its pixel a sample lies: Hammersley's points, the same for all pixels. Their mean is
/// the pixel's centre and no two share a row or a column, so that edges come out where they are,
/// in as many steps as there are samples. \pre count is a power of two
Vector2d place_in_pixel(int index, int count) {
  int reversed = 0;
  for (int bit = 1, mirror = count / 2; mirror > 0; bit *= 2, mirror /= 2) {
    if (index & bit) reversed += mirror;
  }
  return {(index + 0.5) / count, (reversed + 0.5) / count};
}

/// x^24, far cheaper than pow().
float highlight(float x) {
  const float x2 = x * x;
  const float x4 = x2 * x2;
  const float x8 = x4 * x4;
  return x8 * x8 * x8;
}

Vector3d about_z(const Vector3d& v, double cosine, double sine) {
  return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y(), v.z()};
}

}  // namespace

ViewTracer::ViewTracer(const PlacedScene& scene, const PreparedOptics& optics,
                       std::span<const Lamp> lamps, std::span<const TableMap> lamps_seen,
                       std::span<const double> table_angles_deg, const RenderOptions& options)
    : scene_(scene),
      optics_(optics),
      lamps_(lamps),
      lamps_seen_(lamps_seen),
      table_angles_deg_(table_angles_deg.begin(), table_angles_deg.end()),
      options_(options),
      station_from_camera_(optics.optics().camera_from_station.inverse()),
      station_rotation_camera_(station_from_camera_.rotation.toRotationMatrix()) {
  moving_ = std::ranges::any_of(table_angles_deg_,
                                [&](double angle) { return angle != table_angles_deg_.front(); });
  still_cos_ = std::cos(radians(table_angles_deg_.front()));
  still_sin_ = std::sin(radians(table_angles_deg_.front()));
  if (scene.table_from_specimen) {
    specimen_from_table_ = scene.table_from_specimen->inverse();
    table_rotation_specimen_ = scene.table_from_specimen->rotation.toRotationMatrix();
    specimen_rotation_table_ = table_rotation_specimen_.transpose();
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
  const Vector2d place = place_in_pixel(sample.index, sample.count);
  const Vector2d chief = optics_.ray(sample.x + place.x(), sample.y + place.y());
  Vector3d origin = Vector3d::Zero();
  Vector3d direction = chief.homogeneous();
  if (optics.aperture_mm > 0.0) {
    // Thin lens: all rays of an image point meet where its chief ray crosses the plane in focus.
    const Eigen::Vector2f& in_disc =
        scene_.parts->samples.in_disc(mix(sight.pixel_hash, in_pupil), sample.index);
    origin.head<2>() = 0.5 * optics.aperture_mm * in_disc.cast<double>();
    direction -= origin / optics.focus_distance_mm;
  }
  const double length = direction.norm();
  const double filter_px = 1.0 / std::sqrt(static_cast<double>(options_.samples));
  const auto [along_x, along_y] = optics_.pixel_size(sample.x, sample.y);
  const auto change = [&](const Vector2d& of_pixel) -> Vector3d {
    return Vector3d(of_pixel.x(), of_pixel.y(), 0.0) * (filter_px / length);
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
  const auto turned = [&](const Vector3d& v) { return to_table(station_rotation_camera_ * v); };
  sight.ray.origin = to_table(station_rotation_camera_ * origin + station_from_camera_.translation);
  sight.ray.direction = turned(direction / length);
  sight.ray.direction_dx = turned(change(along_x));
  sight.ray.direction_dy = turned(change(along_y));
  return sight;
}

void ViewTracer::add_lamps(const ShadingPoint& point, const Sight& sight, const PixelSample& sample,
                           std::size_t sample_number, bool lamps_in_turn, TracedSample& traced) {
  const int groups = lamps_in_turn ? 2 : 1;
  const auto to_table = [&](const Vector3d& v) {
    return about_z(v, sight.cos_table, -sight.sin_table);
  };
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    const Lamp& lamp = lamps_[i];
    const int group = static_cast<int>(i) % groups;
    const Eigen::Vector2f& at =
        scene_.parts->samples.at(mix(sight.pixel_hash, on_first_lamp + i), sample.index / groups);
    const Vector3d facing = to_table(lamp.facing);
    traced.light += static_cast<float>(lamp.strength * std::max(0.0, -facing.dot(point.normal)));
    const Vector3d to_lamp = to_table(lamp.at(at)) - point.shadow_origin;
    const double distance = to_lamp.norm();
    const Vector3d direction = to_lamp / distance;
    const double cosine = point.normal.dot(direction);
    const double lamp_cosine = -facing.dot(direction);
    if (cosine <= 0.0 || lamp_cosine <= 0.0 || point.flat_normal.dot(direction) <= 0.0) {
      traced.lamps_behind |= static_cast<std::uint8_t>(1U << i);
      continue;
    }

    // `strength` is what a white diffuser at the target sends back; from there the light falls
    // off with both cosines and the square of the distance.
    const auto light =
        static_cast<float>(lamp.strength_at_1_mm * cosine * lamp_cosine / (distance * distance));
    Vector3f radiance = light * point.albedo;
    if (point.gloss > 0.0F) {
      // Blinn 1977 with the normalisation of Akenine-Moeller et al. 2018.
      const Vector3d half = (direction - sight.ray.direction).normalized();
      const auto along = static_cast<float>(std::max(0.0, point.normal.dot(half)));
      radiance.array() += light * point.gloss * (gloss_exponent + 8.0F) / 8.0F * highlight(along);
    }
    if (point.on_table_top) {
      traced.radiance += lamps_seen_[i].at(point.x_table.x(), point.x_table.y()) * radiance;
      continue;
    }
    traced.radiance += radiance;
    if (sample.index % groups != group || !scene_.table_from_specimen) continue;
    lamp_shadows_.push_back(
        {sample_number, static_cast<float>(groups) * radiance, static_cast<std::uint8_t>(1U << i)});
    shadow_rays_.push_back({specimen_from_table_ * point.shadow_origin,
                            specimen_rotation_table_ * direction, distance});
  }
}

void ViewTracer::trace(std::span<const PixelSample> samples, bool lamps_in_turn,
                       std::span<TracedSample> traced) {
  const bool specimen = scene_.table_from_specimen.has_value();
  sights_.clear();
  points_.clear();
  rays_.clear();
  shadow_rays_.clear();
  lamp_shadows_.clear();
  for (const PixelSample& sample : samples) {
    sights_.push_back(sight(sample));
    const SightRay& ray = sights_.back().ray;
    points_.push_back(hit_table(scene_, ray));
    if (specimen) {
      rays_.push_back({specimen_from_table_ * ray.origin, specimen_rotation_table_ * ray.direction,
                       std::min(points_.back().distance_mm, 1e6)});
    }
  }
  hits_.assign(rays_.size(), {});
  if (specimen) scene_.parts->surface->intersect(rays_, hits_);

  for (std::size_t i = 0; i < samples.size(); ++i) {
    ShadingPoint& point = points_[i];
    if (specimen && hits_[i].triangle >= 0) {
      point = specimen_point(scene_, table_rotation_specimen_, sights_[i].ray, hits_[i]);
    } else {
      color_table(scene_, sights_[i].ray, sights_[i].cos_table, sights_[i].sin_table, point);
    }
    traced[i] = {};
    traced[i].object = point.object;
    if (point.object == SceneObject::backdrop) {
      traced[i].radiance = point.albedo;
      continue;
    }
    traced[i].radiance = point.ambient;
    traced[i].light = point.ambient.sum() / std::max(1e-6F, point.albedo.sum());
    add_lamps(point, sights_[i], samples[i], i, lamps_in_turn, traced[i]);
  }
  blocked_.assign(shadow_rays_.size(), 0);
  if (specimen) scene_.parts->surface->occluded(shadow_rays_, blocked_);
  for (std::size_t i = 0; i < lamp_shadows_.size(); ++i) {
    TracedSample& sample = traced[lamp_shadows_[i].sample_number];
    if (blocked_[i]) {
      sample.radiance -= lamp_shadows_[i].radiance;
      sample.lamps_hidden |= lamp_shadows_[i].lamp_bit;
    } else {
      sample.lamps_seen |= lamp_shadows_[i].lamp_bit;
    }
  }
}

}  // namespace skullstation
