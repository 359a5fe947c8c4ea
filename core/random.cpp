#include "core/random.h"

#include <cmath>
#include <numbers>

namespace skullstation {

std::uint64_t Random::below(std::uint64_t bound) {
  // Draws above the largest multiple of the bound would favour small values: draw again.
  const std::uint64_t limit = bound * (UINT64_MAX / bound);
  std::uint64_t draw = bits();
  while (draw >= limit) draw = bits();
  return draw % bound;
}

double Random::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

}  // namespace skullstation
