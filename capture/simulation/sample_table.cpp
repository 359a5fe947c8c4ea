#include "capture/simulation/sample_table.h"

#include <cmath>
#include <numbers>

#include "core/random.h"

namespace skullstation {

namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffU) << 8) | ((x & 0xff00ff00U) >> 8);
  x = ((x & 0x0f0f0f0fU) << 4) | ((x & 0xf0f0f0f0U) >> 4);
  x = ((x & 0x33333333U) << 2) | ((x & 0xccccccccU) >> 2);
  return ((x & 0x55555555U) << 1) | ((x & 0xaaaaaaaaU) >> 1);
}

/// Flips each bit by a hash of the bits above it: Burley 2020, with the permutation of Laine &
/// Karras 2011.
std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x += seed;
  x ^= x * 0x6c50b47cU;
  x ^= x * 0xb82f1e52U;
  x ^= x * 0xc7afe638U;
  x ^= x * 0x8d22f6e6U;
  return reverse_bits(x);
}

/// Second dimension of the Sobol' sequence; the first is reverse_bits(index).
std::uint32_t sobol_second(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t v = 1U << 31; index != 0; index >>= 1, v ^= v >> 1) {
    if (index & 1U) result ^= v;
  }
  return result;
}

/// In [0, 1): the 24 bits that a float holds.
float unit_float(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1.0p-24F; }

Eigen::Vector2f to_disc(const Eigen::Vector2f& square) {
  const float a = 2.0F * square.x() - 1.0F;
  const float b = 2.0F * square.y() - 1.0F;
  if (a == 0.0F && b == 0.0F) return Eigen::Vector2f::Zero();
  constexpr float eighth = std::numbers::pi_v<float> / 4.0F;
  const bool wide = std::abs(a) > std::abs(b);
  const float radius = wide ? a : b;
  const float turn = wide ? eighth * (b / a) : eighth * (2.0F - a / b);
  return {radius * std::cos(turn), radius * std::sin(turn)};
}

}  // namespace

SampleTable::SampleTable(std::uint64_t seed) {
  table_.reserve(sets * points);
  discs_.reserve(sets * points);
  for (std::uint64_t set = 0; set < sets; ++set) {
    const std::uint64_t hash = mix(seed, set);
    const auto x_seed = static_cast<std::uint32_t>(hash);
    const auto y_seed = static_cast<std::uint32_t>(hash >> 32);
    for (std::uint32_t index = 0; index < points; ++index) {
      table_.emplace_back(unit_float(owen_scramble(reverse_bits(index), x_seed)),
                          unit_float(owen_scramble(sobol_second(index), y_seed)));
      discs_.push_back(to_disc(table_.back()));
    }
  }
}

}  // namespace skullstation
