#include "bench/volume/head_with_distances.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "core/random.h"

namespace skullstation {

namespace {

constexpr double blur_mm = 0.4;
constexpr double air_hu = -1000.0;
constexpr double soft_hu = 40.0;
constexpr double cortical_hu = 1400.0;
constexpr double diploe_hu = 450.0;

/// First order in the distance, so exact at the surface (Quilez, "Ellipsoid SDF").
double ellipsoid_mm(const Eigen::Vector3d& p, const Eigen::Vector3d& axes) {
  const double k0 = p.cwiseQuotient(axes).norm();
  const double k1 = p.cwiseQuotient(axes.cwiseAbs2()).norm();
  return k1 < 1e-9 ? -axes.minCoeff() : k0 * (k0 - 1.0) / k1;
}

double capsule_mm(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                  double radius_mm) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm() - radius_mm;
}

double mandible_mm(const Eigen::Vector3d& p) {
  const Eigen::Vector3d side(std::abs(p.x()), p.y(), p.z());  // both halves at once
  return std::min({capsule_mm(side, {0, -84, -98}, {26, -76, -97}, 8.0),
                   capsule_mm(side, {26, -76, -97}, {47, -12, -92}, 8.0),
                   capsule_mm(side, {47, -12, -92}, {50, -4, -60}, 7.0)});
}

double vault_mm(const Eigen::Vector3d& p) {
  const double shell = std::max(ellipsoid_mm(p, {68, 88, 68}), -ellipsoid_mm(p, {61, 81, 61}));
  const double foramen = std::hypot(p.x(), p.y() - 20.0) - 16.0;
  return p.z() < 0.0 ? std::max(shell, -foramen) : shell;
}

double spine_mm(const Eigen::Vector3d& p) {
  const double radius = std::hypot(p.x(), p.y() - 20.0);
  return std::max(std::abs(radius - 18.0) - 6.0, p.z() + 78.0);
}

/// The share of a scanner's blurred point that lies inside.
double inside_share(double distance_mm) {
  return 0.5 * std::erfc(distance_mm / (blur_mm * std::numbers::sqrt2));
}

double hu_at(const Eigen::Vector3d& p) {
  const double skin_mm = HeadWithDistances::from_skin_mm(p);
  if (skin_mm > 5.0 * blur_mm) return air_hu;
  double hu = air_hu + (soft_hu - air_hu) * inside_share(skin_mm);
  if (skin_mm > -1.0) return hu;
  const double bone_mm = std::min(HeadWithDistances::from_skull_mm(p), spine_mm(p));
  if (bone_mm > 5.0 * blur_mm) return hu;
  hu += (cortical_hu - hu) * inside_share(bone_mm);
  const double diploe_mm = std::max(ellipsoid_mm(p, {66, 86, 66}), -ellipsoid_mm(p, {63, 83, 63}));
  if (p.z() > -20.0) hu += (diploe_hu - hu) * inside_share(diploe_mm);
  return hu;
}

}  // namespace

double HeadWithDistances::from_skin_mm(const Eigen::Vector3d& p) {
  return std::min({ellipsoid_mm(p - Eigen::Vector3d(0, -2, 0), {80, 102, 82}),
                   ellipsoid_mm(p - Eigen::Vector3d(0, -30, -70), {68, 74, 52}),
                   std::max(std::hypot(p.x(), p.y() - 12.0) - 55.0, p.z() + 50.0),
                   ellipsoid_mm(p - Eigen::Vector3d(0, -106, -30), {15, 22, 18})});
}

double HeadWithDistances::from_skull_mm(const Eigen::Vector3d& p) {
  return std::min(vault_mm(p), mandible_mm(p));
}

Volume HeadWithDistances::scan(const VoxelGrid& grid, double noise_hu, std::uint64_t seed,
                               int threads) {
  constexpr int layers = 4;  // of a slice's thickness
  Volume volume;
  volume.grid = grid;
  volume.hu.resize(grid.count());
  parallel_for(grid.size.z(), threads, [&](int k) {
    Random random(seed + static_cast<std::uint64_t>(k));
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        double hu = 0.0;
        for (int layer = 0; layer < layers; ++layer) {
          const double z = k + (layer + 0.5) / layers - 0.5;
          hu += hu_at(grid.patient_from_voxel({static_cast<double>(i), static_cast<double>(j), z}));
        }
        volume.at(i, j, k) = static_cast<std::int16_t>(
            std::lround(std::max(-1024.0, random.normal(hu / layers, noise_hu))));
      }
    }
  });
  return volume;
}

}  // namespace skullstation
