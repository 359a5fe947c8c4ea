#include "reconstruction/rendering/mesh_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/rendering/ray_scene.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

double linear_from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

double srgb_from_linear(double value) {
  value = std::clamp(value, 0.0, 1.0);
  return value <= 0.0031308 ? value * 12.92 : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

/// Linear values of the 256 steps of a vertex colour.
const std::array<double, 256>& linear_table() {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = linear_from_srgb(static_cast<double>(i) / 255.0);
    }
    return values;
  }();
  return table;
}

Vector3d linear(const Vector3d& srgb) { return srgb.unaryExpr(&linear_from_srgb); }

/// A lamp far away: `spread` is the radius of its disc as seen, in units of the distance.
struct Lamp {
  Vector3d toward;  ///< in the camera's axes
  double spread;
  double strength;
};
const std::array lamps = {Lamp{Vector3d(-0.55, 0.65, 0.75).normalized(), 0.35, 0.75},
                          Lamp{Vector3d(0.85, 0.15, 0.45).normalized(), 0.5, 0.16}};
constexpr double ambient_strength = 0.42;
/// Hollows deeper than this get light from their far side all the same.
constexpr double ambient_reach_mm = 80.0;
/// The backs of triangles, seen where a surface is open.
constexpr double back_dimming = 0.55;

/// Low-discrepancy points, turned for each pixel by its own random offset.
struct PixelSamples {
  std::uint64_t pixel;

  double operator()(std::uint64_t sample, std::uint64_t dimension) const {
    // Additive recurrence with the square roots of primes, well spread in each dimension.
    static constexpr std::array primes = {2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0};
    const double offset = static_cast<double>(mix(pixel, dimension) >> 11) * 0x1.0p-53;
    const double value = offset + static_cast<double>(sample + 1) * std::sqrt(primes[dimension]);
    return value - std::floor(value);
  }
};

/// A unit vector spread about `axis`: cosine-distributed for `spread` = 1 (Malley's method).
Vector3d around(const Vector3d& axis, double spread, double a, double b) {
  const Vector3d other = std::abs(axis.x()) < 0.7 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d side = axis.cross(other).normalized();
  const double radius = spread * std::sqrt(a);
  const double angle = 2.0 * std::numbers::pi * b;
  const double along = std::sqrt(std::max(0.0, 1.0 - radius * radius));
  return (radius * std::cos(angle) * side + radius * std::sin(angle) * axis.cross(side) +
          along * axis)
      .normalized();
}

class Painter {
 public:
  Painter(std::span<const PicturedMesh> meshes, const PictureCamera& camera,
          const PictureOptions& options)
      : meshes_(meshes),
        camera_(camera),
        options_(options),
        background_(linear(options.background)),
        all_(pointers(false)),
        opaque_(pointers(true)) {
    for (const PicturedMesh& pictured : meshes) {
      const bool given = pictured.mesh->normals.rows() == pictured.mesh->vertices.rows();
      normals_.push_back(given ? pictured.mesh->normals : vertex_normals(*pictured.mesh));
      colors_.push_back(linear(pictured.color));
    }
  }

  void paint_row(int y, Image8& image) const {
    for (int x = 0; x < options_.width; ++x) {
      const PixelSamples random{static_cast<std::uint64_t>(y) * options_.width + x};
      Vector3d sum = Vector3d::Zero();
      for (int sample = 0; sample < options_.samples; ++sample) {
        sum += light_at(x, y, random, static_cast<std::uint64_t>(sample));
      }
      for (int c = 0; c < 3; ++c) {
        const double value = srgb_from_linear(sum[c] / options_.samples);
        image.at(x, y, c) = static_cast<std::uint8_t>(std::lround(255.0 * value));
      }
    }
  }

 private:
  std::vector<const TriangleMesh*> pointers(bool opaque_only) const {
    std::vector<const TriangleMesh*> chosen;
    for (const PicturedMesh& pictured : meshes_) {
      if (!opaque_only || pictured.opacity >= 1.0) chosen.push_back(pictured.mesh);
    }
    return chosen;
  }

  Vector3d light_at(int x, int y, const PixelSamples& random, std::uint64_t sample) const {
    const double u = (x + random(sample, 0) - 0.5 * options_.width) / options_.height;
    const double v = (0.5 * options_.height - y - random(sample, 1)) / options_.height;
    const Vector3d origin = camera_.eye();
    const Vector3d direction = (camera_.in_plane(u, v) - origin).normalized();

    Vector3d light = Vector3d::Zero();
    double transmitted = 1.0;
    double nearest = 0.0;
    while (transmitted > 1e-3) {
      const std::optional<RayHit> hit = all_.first_hit(origin, direction, nearest);
      if (!hit) return light + transmitted * background_;
      const double opacity = meshes_[static_cast<std::size_t>(hit->mesh)].opacity;
      light += transmitted * opacity *
               shade(*hit, origin + hit->distance_mm * direction, direction, random, sample);
      transmitted *= 1.0 - opacity;
      nearest = hit->distance_mm * (1.0 + 1e-6) + 1e-3;
    }
    return light;
  }

  Vector3d shade(const RayHit& hit, const Vector3d& point, const Vector3d& direction,
                 const PixelSamples& random, std::uint64_t sample) const {
    const auto which = static_cast<std::size_t>(hit.mesh);
    const TriangleMesh& mesh = *meshes_[which].mesh;
    const Eigen::RowVector3i corners = mesh.triangles.row(hit.triangle);
    const Vector3d weights(1.0 - hit.u - hit.v, hit.u, hit.v);

    const Vector3d a = mesh.vertices.row(corners[0]);
    const Vector3d b = mesh.vertices.row(corners[1]);
    const Vector3d c = mesh.vertices.row(corners[2]);
    Vector3d flat = (b - a).cross(c - a).normalized();
    Vector3d normal = Vector3d::Zero();
    Vector3d albedo = mesh.colors.rows() > 0 ? Vector3d::Zero() : colors_[which];
    for (int k = 0; k < 3; ++k) {
      normal += weights[k] * normals_[which].row(corners[k]).transpose();
      if (mesh.colors.rows() > 0) {
        for (int channel = 0; channel < 3; ++channel) {
          albedo[channel] += weights[k] * linear_table()[mesh.colors(corners[k], channel)];
        }
      }
    }
    const bool back = flat.dot(direction) > 0.0;
    if (back) {
      flat = -flat;
      normal = -normal;
      albedo *= back_dimming;
    }
    normal = normal.norm() > 1e-9 ? Vector3d(normal.normalized()) : flat;

    const Vector3d start = point + (1e-4 * camera_.height_mm) * flat;
    double light = 0.0;
    for (std::size_t i = 0; i < lamps.size(); ++i) {
      const Vector3d toward = around(camera_.axes.transpose() * lamps[i].toward, lamps[i].spread,
                                     random(sample, 2 + 2 * i), random(sample, 3 + 2 * i));
      const double cosine = normal.dot(toward);
      if (cosine <= 0.0 || flat.dot(toward) <= 0.0) continue;
      if (!opaque_.blocked(start, toward, 10.0 * camera_.distance_mm)) {
        light += lamps[i].strength * cosine;
      }
    }
    const Vector3d sky = around(normal, 1.0, random(sample, 6), random(sample, 7));
    if (flat.dot(sky) <= 0.0 || !opaque_.blocked(start, sky, ambient_reach_mm)) {
      light += ambient_strength;
    }
    return light * albedo;
  }

  std::span<const PicturedMesh> meshes_;
  const PictureCamera& camera_;
  const PictureOptions& options_;
  Vector3d background_;
  RayScene all_;
  RayScene opaque_;
  std::vector<Points3> normals_;
  std::vector<Vector3d> colors_;
};

Result<void> check(const PicturedMesh& pictured) {
  const TriangleMesh& mesh = *pictured.mesh;
  const bool in_range =
      mesh.triangles.size() == 0 ||
      (mesh.triangles.minCoeff() >= 0 && mesh.triangles.maxCoeff() < mesh.vertices.rows());
  if (!in_range) return fail(ErrorKind::bad_input, "picture", "a triangle names no vertex");
  if (mesh.colors.rows() != 0 && mesh.colors.rows() != mesh.vertices.rows()) {
    return fail(
        ErrorKind::bad_input, "picture",
        fmt::format("{} colours for {} vertices", mesh.colors.rows(), mesh.vertices.rows()));
  }
  if (!(pictured.opacity > 0.0 && pictured.opacity <= 1.0)) {
    return fail(ErrorKind::usage, "picture: opacity",
                fmt::format("must be in (0, 1], not {}", pictured.opacity));
  }
  return {};
}

}  // namespace

Result<void> PictureOptions::validate() const {
  const auto in_range = [](const char* name, int value, int low, int high) -> Result<void> {
    if (value >= low && value <= high) return {};
    return fail(ErrorKind::usage, fmt::format("picture: {}", name),
                fmt::format("must be from {} to {}, not {}", low, high, value));
  };
  if (Result<void> valid = in_range("width", width, 1, 16384); !valid) return valid;
  if (Result<void> valid = in_range("height", height, 1, 16384); !valid) return valid;
  return in_range("samples", samples, 1, 256);
}

Result<Image8> render_picture(std::span<const PicturedMesh> meshes, const PictureCamera& camera,
                              const PictureOptions& options) {
  if (Result<void> valid = options.validate(); !valid) return forward(valid);
  for (const PicturedMesh& pictured : meshes) {
    if (Result<void> valid = check(pictured); !valid) return forward(valid);
  }
  const Painter painter(meshes, camera, options);
  Image8 image(options.width, options.height, 3);
  parallel_for(options.height, options.threads, [&](int y) { painter.paint_row(y, image); });
  return image;
}

}  // namespace skullstation
