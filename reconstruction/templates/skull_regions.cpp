#include "reconstruction/templates/skull_regions.h"

#include <limits>

namespace skullstation {

namespace {

struct Seed {
  SkullRegion left;
  SkullRegion right;
  double x, y, z;  ///< on the left side, x >= 0 [mm]
};

using enum SkullRegion;

constexpr Seed kSeeds[] = {
    {calvaria, calvaria, 0, 12, 118},
    {calvaria, calvaria, 40, 12, 102},
    {calvaria, calvaria, 62, 18, 76},
    {calvaria, calvaria, 0, -70, 86},
    {calvaria, calvaria, 0, -80, 66},
    {calvaria, calvaria, 32, -72, 66},
    {calvaria, calvaria, 42, -50, 78},
    {calvaria, calvaria, 54, -40, 62},
    {calvaria, calvaria, 0, 57, 108},
    {calvaria, calvaria, 45, 60, 80},
    {occiput, occiput, 0, 100, 32},
    {occiput, occiput, 0, 91, -2},
    {occiput, occiput, 0, 96, 58},
    {occiput, occiput, 34, 85, 48},
    {occiput, occiput, 40, 80, 18},
    {occiput, occiput, 30, 75, -8},
    {base, base, 0, 40, -29},
    {base, base, 0, 60, -22},
    {base, base, 0, 0, -21},
    {base, base, 25, 25, -18},
    {base, base, 25, -5, -15},
    {base, base, 0, -30, -5},
    {base, base, 15, -38, -22},
    {temporal_left, temporal_right, 62, 0, 20},
    {temporal_left, temporal_right, 58, -28, 38},
    {temporal_left, temporal_right, 66, 32, 30},
    {temporal_left, temporal_right, 53, 9, -18},
    {temporal_left, temporal_right, 55, 0, 2},
    {zygoma_left, zygoma_right, 60, -28, 0},
    {zygoma_left, zygoma_right, 56, -45, 2},
    {zygoma_left, zygoma_right, 47, -62, -4},
    {zygoma_left, zygoma_right, 43, -63, -18},
    {orbit_left, orbit_right, 26, -77, 43},
    {orbit_left, orbit_right, 48, -62, 22},
    {orbit_left, orbit_right, 49, -62, 36},
    {orbit_left, orbit_right, 29, -74, 1},
    {orbit_left, orbit_right, 12, -74, 26},
    {orbit_left, orbit_right, 28, -52, 20},
    {nose, nose, 0, -92, 22},
    {nose, nose, 0, -100, 13},
    {nose, nose, 0, -84, 33},
    {nose, nose, 0, -83, 48},
    {nose, nose, 12, -80, -6},
    {nose, nose, 0, -75, 5},
    {nose, nose, 0, -50, 0},
    {nose, nose, 0, -90, -15},
    {maxilla, maxilla, 26, -75, -14},
    {maxilla, maxilla, 17, -86, -20},
    {maxilla, maxilla, 0, -94, -23},
    {maxilla, maxilla, 30, -58, -22},
    {maxilla, maxilla, 0, -68, -19},
    {upper_teeth, upper_teeth, 6, -93, -34},
    {upper_teeth, upper_teeth, 18, -86, -34},
    {upper_teeth, upper_teeth, 26, -72, -34},
    {upper_teeth, upper_teeth, 29, -58, -34},
    {chin, chin, 0, -91, -62},
    {chin, chin, 13, -86, -65},
    {mandible_body_left, mandible_body_right, 26, -72, -60},
    {mandible_body_left, mandible_body_right, 32, -58, -58},
    {mandible_body_left, mandible_body_right, 36, -45, -56},
    {ramus_left, ramus_right, 43, -37, -32},
    {ramus_left, ramus_right, 39, -27, -50},
    {ramus_left, ramus_right, 45, -20, -22},
    {ramus_left, ramus_right, 42, -12, -3},
    {ramus_left, ramus_right, 41, -50, -12},
    {lower_teeth, lower_teeth, 6, -90, -43},
    {lower_teeth, lower_teeth, 16, -84, -43},
    {lower_teeth, lower_teeth, 25, -70, -43},
    {lower_teeth, lower_teeth, 29, -57, -42},
};

}  // namespace

SkullRegion skull_region_at(const Eigen::Vector3d& point_mm, SkullBone bone) {
  const Eigen::Vector3d on_left(std::abs(point_mm.x()), point_mm.y(), point_mm.z());
  double least = std::numeric_limits<double>::infinity();
  SkullRegion region = calvaria;
  for (const Seed& seed : kSeeds) {
    if (bone_of(seed.left) != bone) continue;
    const double squared = (on_left - Eigen::Vector3d(seed.x, seed.y, seed.z)).squaredNorm();
    if (squared >= least) continue;
    least = squared;
    region = point_mm.x() >= 0.0 ? seed.left : seed.right;
  }
  return region;
}

}  // namespace skullstation
