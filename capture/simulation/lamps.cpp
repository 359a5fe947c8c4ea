#include "capture/simulation/lamps.h"

#include <cstdint>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "core/transform.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

constexpr int rays_per_point = 16;
/// Above the table, so that a specimen that touches it casts its shadow right up to where it
/// stands.
constexpr double height_mm = 0.1;

}  // namespace

std::vector<Lamp> make_lamps(std::span<const SoftBox> boxes) {
  std::vector<Lamp> lamps;
  for (const SoftBox& box : boxes) {
    const Vector3d axis = box.target_mm - box.centre_mm;
    const Vector3d facing = axis.normalized();
    Vector3d across = facing.cross(Vector3d::UnitZ());
    if (across.norm() < 1e-9) across = Vector3d::UnitX();
    across.normalize();
    lamps.push_back({box.centre_mm, facing, 0.5 * box.width_mm * across,
                     0.5 * box.height_mm * facing.cross(across), box.strength,
                     box.strength * axis.squaredNorm()});
  }
  return lamps;
}

std::vector<TableMap> lamps_seen_from_table(const PlacedScene& scene, std::span<const Lamp> lamps,
                                            double table_angle_deg, int threads) {
  std::vector<TableMap> maps(lamps.size());
  if (!scene.table_from_specimen) return maps;
  const Rigid3 specimen_from_table = scene.table_from_specimen->inverse();
  const Rigid3 specimen_from_station = specimen_from_table * rotation_about_z(-table_angle_deg);
  constexpr int size = TableMap::size;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    std::vector<float> seen(static_cast<std::size_t>(size) * size, 0.0F);
    parallel_for(size, threads, [&](int row) {
      std::vector<SpecimenRay> rays;
      rays.reserve(static_cast<std::size_t>(size) * rays_per_point);
      for (int column = 0; column < size; ++column) {
        const Vector3d origin = specimen_from_table * Vector3d(TableMap::place_mm(column),
                                                               TableMap::place_mm(row), height_mm);
        const std::uint64_t set =
            mix(i, static_cast<std::uint64_t>(row) * size + static_cast<std::uint64_t>(column));
        for (int ray = 0; ray < rays_per_point; ++ray) {
          const Vector3d to_lamp =
              specimen_from_station * lamps[i].at(scene.parts->samples.at(set, ray)) - origin;
          const double distance = to_lamp.norm();
          rays.push_back({origin, to_lamp / distance, distance});
        }
      }
      std::vector<std::uint8_t> blocked(rays.size());
      scene.parts->surface->occluded(rays, blocked);
      float* seen_row = seen.data() + static_cast<std::size_t>(row) * size;
      for (std::size_t ray = 0; ray < rays.size(); ++ray) {
        if (!blocked[ray]) seen_row[ray / rays_per_point] += 1.0F / rays_per_point;
      }
    });
    maps[i] = TableMap(std::move(seen)).smoothed();
  }
  return maps;
}

}  // namespace skullstation
