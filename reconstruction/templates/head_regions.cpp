#include "reconstruction/templates/head_regions.h"

#include <cmath>
#include <limits>

namespace skullstation {

namespace {

struct Seed {
  HeadRegion region;
  double x, y, z;  ///< on the left side, x >= 0 [mm]
};

using enum HeadRegion;

constexpr Seed kSeeds[] = {
    {nose, 0, -117, -7},   {nose, 0, -103, 15},   {nose, 18, -98, -11},  {nose, 0, -96, 26},
    {nose, 10, -102, 3},   {nose, 0, -108, -15},  {lips, 0, -106, -33},  {lips, 0, -106, -44},
    {lips, 14, -101, -34}, {lips, 14, -101, -43}, {lips, 26, -93, -39},  {eyes, 31, -80, 18},
    {eyes, 20, -79, 17},   {eyes, 42, -74, 19},   {eyes, 31, -80, 27},   {eyes, 31, -80, 9},
    {ears, 70, -3, 3},     {ears, 82, 10, 29},    {ears, 71, -2, -28},   {ears, 86, 14, 8},
    {ears, 80, 12, -12},   {face, 0, -89, 47},    {face, 0, -84, 66},    {face, 32, -83, 48},
    {face, 30, -79, 66},   {face, 54, -66, 40},   {face, 62, -50, 30},   {face, 58, -60, 15},
    {face, 30, -83, -6},   {face, 12, -88, 12},   {face, 45, -76, -8},   {face, 55, -66, -30},
    {face, 36, -86, -26},  {face, 0, -105, -23},  {face, 14, -102, -24}, {face, 40, -84, -50},
    {face, 0, -103, -57},  {face, 0, -103, -68},  {face, 22, -96, -62},  {face, 38, -70, -70},
    {face, 67, -28, 0},    {face, 62, -40, -28},  {face, 48, -30, -60},  {face, 54, -18, -45},
    {face, 62, -20, -20},  {face, 0, -94, -76},   {scalp, 0, 12, 123},   {scalp, 60, 20, 92},
    {scalp, 76, 30, 50},   {scalp, 0, 106, 30},   {scalp, 50, 80, 40},   {scalp, 0, -66, 96},
    {scalp, 72, -14, 55},  {scalp, 45, -46, 86},  {scalp, 58, 68, 4},    {scalp, 0, 90, 80},
    {scalp, 0, 98, 0},     {scalp, 66, 42, 8},    {neck, 0, -60, -92},   {neck, 45, -30, -92},
    {neck, 56, 20, -75},   {neck, 0, 70, -80},    {neck, 40, 62, -55},   {neck, 0, 85, -45},
    {neck, 58, 25, -48},   {neck, 28, -60, -86},
};

}  // namespace

HeadRegion head_region_at(const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d on_left(std::abs(point_mm.x()), point_mm.y(), point_mm.z());
  double least = std::numeric_limits<double>::infinity();
  HeadRegion region = face;
  for (const Seed& seed : kSeeds) {
    const double squared = (on_left - Eigen::Vector3d(seed.x, seed.y, seed.z)).squaredNorm();
    if (squared >= least) continue;
    least = squared;
    region = seed.region;
  }
  return region;
}

}  // namespace skullstation
