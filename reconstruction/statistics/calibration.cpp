#include "reconstruction/statistics/calibration.h"

#include <algorithm>
#include <cmath>

namespace skullstation {

Result<double> conformal_factor(std::span<const double> ratios, double level) {
  const auto bad = [](const char* what) {
    return fail(ErrorKind::bad_input, "band calibration", what);
  };
  if (ratios.empty()) return bad("has no errors to learn from");
  if (!(level > 0.0 && level < 1.0)) return bad("its level must lie between 0 and 1");
  std::vector<double> sorted(ratios.begin(), ratios.end());
  const auto count = static_cast<double>(sorted.size());
  const double rank = std::min(std::ceil((count + 1.0) * level), count);
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(rank) - 1;
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

BandCoverage coverage_of(std::span<const double> ratios, double factor) {
  const auto n = static_cast<double>(ratios.size());
  const auto inside = static_cast<double>(
      std::ranges::count_if(ratios, [&](double ratio) { return ratio <= factor; }));
  if (n == 0.0) return {};
  constexpr double z = 1.959964;
  const double share = inside / n;
  const double middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half =
      z / (1.0 + z * z / n) * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n));
  return {share, middle - half, middle + half};
}

}  // namespace skullstation
