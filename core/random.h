#pragma once

#include <cstdint>

namespace skullstation {

/// A well-mixed 64-bit hash (the finaliser of splitmix64, Steele et al. 2014). Hashing a seed
/// with an index gives every pixel, view or person a random stream of its own, whatever thread
/// works on it and in whatever order.
constexpr std::uint64_t mix(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t z = seed + (index + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// Seeded random numbers, the same on every machine (the standard library's distributions are
/// not): splitmix64 as the generator.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() { return mix(state_, count_++); }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in [0, bound).
  std::uint64_t below(std::uint64_t bound);
  /// Standard normal (Box & Muller 1958).
  double normal();
  double normal(double mean, double sd) { return mean + sd * normal(); }

 private:
  std::uint64_t state_;
  std::uint64_t count_ = 0;
};

}  // namespace skullstation
