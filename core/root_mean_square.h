#pragma once

#include <cmath>
#include <span>

namespace skullstation {

/// 0 of none.
inline double root_mean_square(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace skullstation
