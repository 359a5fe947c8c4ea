#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Factors that make predicted standard deviations honest, for one region of the face.
struct BandFactor {
  std::string region;
  double level = 0.8;   ///< share of the truth that the band shall hold
  double factor = 1.0;  ///< half width of the band in predicted standard deviations
  int values = 0;       ///< errors that it was learnt from
};

/// Conformal factor (Vovk et al. 2005; Barber et al. 2021 for predictions left one out): the
/// ceil((n + 1) level)-th smallest of |error| / SD, so that a new one lies within it with at least
/// the probability `level`, whatever its distribution. With too few ratios for the level the
/// greatest is given. Fails with `bad_input` without ratios, or for a level outside 0..1.
Result<double> conformal_factor(std::span<const double> ratios, double level);

/// Share of |error| <= factor SD, with its 95 % confidence interval (Wilson 1927).
struct BandCoverage {
  double share = 0.0;
  double low = 0.0;
  double high = 1.0;
};
BandCoverage coverage_of(std::span<const double> ratios, double factor);

}  // namespace skullstation
