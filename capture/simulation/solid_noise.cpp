#include "capture/simulation/solid_noise.h"

#include <algorithm>

namespace skullstation {

namespace {

constexpr std::uint32_t x_factor = 0x8da6b343U;
constexpr std::uint32_t y_factor = 0xd8163841U;
constexpr std::uint32_t z_factor = 0xcb1ab31fU;

// Four lanes at once, for the four corners of a cell that share their z (GCC's and Clang's vector
// types: SSE2 on x86-64, NEON on arm64).
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Bits4 = std::uint32_t __attribute__((vector_size(16)));

template <class Bits>
Bits scatter(Bits h) {
  h ^= h >> 16;
  h *= 0x7feb352dU;
  h ^= h >> 15;
  h *= 0x846ca68bU;
  return h ^ (h >> 16);
}

/// Dot products of (x, y, z) with gradients that the hashes pick, their components in [-1, 1).
Float4 gradient_dots(Bits4 hashes, Float4 x, Float4 y, float z) {
  const auto component = [&](int shift) {
    return __builtin_convertvector(reinterpret_cast<Int4>((hashes >> shift) & 0x3ffU) - 512,
                                   Float4);
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
  const Bits4 xy =
      Bits4{hx, hx + x_factor, hx, hx + x_factor} ^ Bits4 { hy, hy, hy + y_factor, hy + y_factor };
  const Float4 x4{dx, dx - 1.0F, dx, dx - 1.0F};
  const Float4 y4{dy, dy, dy - 1.0F, dy - 1.0F};
  const Float4 low = gradient_dots(scatter(xy ^ (hz ^ seed)), x4, y4, dz);
  const Float4 high = gradient_dots(scatter(xy ^ ((hz + z_factor) ^ seed)), x4, y4, dz - 1.0F);
  const Float4 between = low + fade(dz) * (high - low);
  const float u = fade(dx);
  return blend(blend(between[0], between[1], u), blend(between[2], between[3], u), fade(dy));
}

float visible_share(float wavelength, float footprint) {
  return std::clamp(wavelength / footprint - 1.0F, 0.0F, 1.0F);
}

}  // namespace skullstation
