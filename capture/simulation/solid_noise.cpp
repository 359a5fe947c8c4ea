#include "capture/simulation/solid_noise.h"

#include <algorithm>
#include <cmath>

namespace skullstation {

std::uint32_t cell_hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed ^ (static_cast<std::uint32_t>(x) * 0x8da6b343U) ^
                    (static_cast<std::uint32_t>(y) * 0xd8163841U) ^
                    (static_cast<std::uint32_t>(z) * 0xcb1ab31fU);
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
  return h ^ (h >> 16);
}

namespace {

/// Dot product of (x, y, z) with a gradient that the hash picks, its components in [-1, 1).
float gradient_dot(std::uint32_t h, float x, float y, float z) {
  const auto component = [&](int shift) {
    return static_cast<float>(static_cast<std::int32_t>((h >> shift) & 0x3ffU) - 512) / 512.0F;
  };
  return component(0) * x + component(10) * y + component(20) * z;
}

float fade(float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); }
float blend(float a, float b, float t) { return a + t * (b - a); }

}  // namespace

float gradient_noise(const Eigen::Vector3f& x, std::uint32_t seed) {
  const float fx = std::floor(x.x());
  const float fy = std::floor(x.y());
  const float fz = std::floor(x.z());
  const int ix = static_cast<int>(fx);
  const int iy = static_cast<int>(fy);
  const int iz = static_cast<int>(fz);
  const float dx = x.x() - fx;
  const float dy = x.y() - fy;
  const float dz = x.z() - fz;
  float corner[8];
  for (int c = 0; c < 8; ++c) {
    const int cx = c & 1;
    const int cy = (c >> 1) & 1;
    const int cz = c >> 2;
    corner[c] =
        gradient_dot(cell_hash(ix + cx, iy + cy, iz + cz, seed), dx - static_cast<float>(cx),
                     dy - static_cast<float>(cy), dz - static_cast<float>(cz));
  }
  const float u = fade(dx);
  const float v = fade(dy);
  const float low = blend(blend(corner[0], corner[1], u), blend(corner[2], corner[3], u), v);
  const float high = blend(blend(corner[4], corner[5], u), blend(corner[6], corner[7], u), v);
  return blend(low, high, fade(dz));
}

float visible_share(float wavelength, float footprint) {
  return std::clamp(wavelength / footprint - 1.0F, 0.0F, 1.0F);
}

}  // namespace skullstation
