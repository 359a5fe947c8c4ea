#include "capture/simulation/solid_noise.h"

#include <algorithm>

namespace skullstation {

namespace {

constexpr std::uint32_t x_factor = 0x8da6b343U;
constexpr std::uint32_t y_factor = 0xd8163841U;
constexpr std::uint32_t z_factor = 0xcb1ab31fU;

std::uint32_t scatter(std::uint32_t h) {
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
  return h ^ (h >> 16);
}

/// Dot product of (x, y, z) with a gradient that the hash picks, its components in [-1, 1).
float gradient_dot(std::uint32_t h, float x, float y, float z) {
  const auto component = [&](int shift) {
    return static_cast<float>(static_cast<std::int32_t>((h >> shift) & 0x3ffU) - 512);
  };
  return (component(0) * x + component(10) * y + component(20) * z) * (1.0F / 512.0F);
}

float fade(float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); }
float blend(float a, float b, float t) { return a + t * (b - a); }

}  // namespace

std::uint32_t cell_hash(int x, int y, int z, std::uint32_t seed) {
  return scatter(seed ^ (static_cast<std::uint32_t>(x) * x_factor) ^
                 (static_cast<std::uint32_t>(y) * y_factor) ^
                 (static_cast<std::uint32_t>(z) * z_factor));
}

int cell_of(float x) {
  const int toward_zero = static_cast<int>(x);
  return toward_zero - (static_cast<float>(toward_zero) > x ? 1 : 0);
}

float gradient_noise(const Eigen::Vector3f& x, std::uint32_t seed) {
  const int ix = cell_of(x.x());
  const int iy = cell_of(x.y());
  const int iz = cell_of(x.z());
  const float dx = x.x() - static_cast<float>(ix);
  const float dy = x.y() - static_cast<float>(iy);
  const float dz = x.z() - static_cast<float>(iz);
  const std::uint32_t hx = static_cast<std::uint32_t>(ix) * x_factor;
  const std::uint32_t hy = static_cast<std::uint32_t>(iy) * y_factor;
  const std::uint32_t hz = static_cast<std::uint32_t>(iz) * z_factor;
  const std::uint32_t x_terms[2] = {seed ^ hx, seed ^ (hx + x_factor)};
  const std::uint32_t yz_terms[4] = {hy ^ hz, (hy + y_factor) ^ hz, hy ^ (hz + z_factor),
                                     (hy + y_factor) ^ (hz + z_factor)};
  float corner[8];
  for (int c = 0; c < 8; ++c) {
    corner[c] =
        gradient_dot(scatter(x_terms[c & 1] ^ yz_terms[c >> 1]), dx - static_cast<float>(c & 1),
                     dy - static_cast<float>((c >> 1) & 1), dz - static_cast<float>(c >> 2));
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
