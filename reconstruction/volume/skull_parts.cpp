#include "reconstruction/volume/skull_parts.h"

#include <algorithm>
#include <cmath>

namespace skullstation {

namespace {

constexpr double least_mandible_width_mm = 55.0;
constexpr double least_mandible_depth_mm = 40.0;
constexpr double least_mandible_mm3 = 4000.0;
constexpr double in_front_of_canal_mm = 40.0;
constexpr double least_mandible_below_mm3 = 5000.0;
constexpr double well_below_foramen_mm = 25.0;
/// Nearer to the foramen's height outlines may be the skull base's.
constexpr double ramus_below_foramen_mm = 15.0;

}  // namespace

SkullParts find_skull_parts(const VoxelMask& bone, const Eigen::Vector3d& spacing_mm) {
  const VoxelComponents parts(bone, Connectivity::edge18);
  const int largest = parts.largest();
  SkullParts result;
  std::vector<bool> keep(parts.all().size(), false);
  for (std::size_t p = 0; p < keep.size(); ++p) {
    const auto& part = parts.all()[p];
    const Eigen::Vector3d extent_mm =
        (part.most - part.least).cast<double>().cwiseProduct(spacing_mm);
    const bool mandible =
        static_cast<double>(part.voxels) * spacing_mm.prod() >= least_mandible_mm3 &&
        extent_mm.x() >= least_mandible_width_mm && extent_mm.y() >= least_mandible_depth_mm;
    keep[p] = static_cast<int>(p) == largest || mandible;
    if (keep[p] && static_cast<int>(p) != largest) result.mandible_apart = true;
    ++(keep[p] ? result.parts_kept : result.parts_removed);
  }
  result.skull = parts.mask_of(keep);
  return result;
}

std::optional<MandibleExtent> find_mandible(const VoxelMask& skull, const SpinalCanal& canal,
                                            const Eigen::Vector3d& spacing_mm) {
  MandibleExtent extent;
  extent.lowest_z_mm = 1e9;
  extent.most_posterior_mm.y() = -1e9;
  double below_mm3 = 0.0;
  const double foramen_z_mm = canal.foramen_magnum_mm.z();
  for (int k = 0; k < skull.size.z() && k * spacing_mm.z() < foramen_z_mm; ++k) {
    const double z_mm = k * spacing_mm.z();
    const double front_y_mm = canal.middle_at(z_mm).y() - in_front_of_canal_mm;
    VoxelMask slice(Eigen::Vector3i(skull.size.x(), skull.size.y(), 1));
    std::copy_n(skull.on.begin() + static_cast<std::ptrdiff_t>(skull.index(0, 0, k)),
                slice.on.size(), slice.on.begin());
    const VoxelComponents outlines(slice, Connectivity::edge18);
    for (const auto& outline : outlines.all()) {
      if (outline.least.y() * spacing_mm.y() > front_y_mm) continue;
      extent.lowest_z_mm = std::min(extent.lowest_z_mm, z_mm);
      if (z_mm < foramen_z_mm - well_below_foramen_mm) {
        below_mm3 += static_cast<double>(outline.voxels) * spacing_mm.prod();
      }
      if (z_mm > foramen_z_mm - ramus_below_foramen_mm) continue;
      const double posterior_mm = outline.most.y() * spacing_mm.y();
      // An outline that reaches behind the canal's middle has joined the skull base.
      if (posterior_mm > canal.middle_at(z_mm).y()) continue;
      if (posterior_mm <= extent.most_posterior_mm.y()) continue;
      extent.most_posterior_mm = {0.5 * (outline.least.x() + outline.most.x()) * spacing_mm.x(),
                                  posterior_mm, z_mm};
    }
  }
  if (below_mm3 < least_mandible_below_mm3) return std::nullopt;
  return extent;
}

}  // namespace skullstation
