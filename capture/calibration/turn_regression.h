#pragma once

#include <vector>

namespace skullstation {

/// Measured against commanded angles, in the order of time.
struct TurnRegression {
  std::vector<double> commanded_deg;  ///< as given, continued through full turns
  std::vector<double> measured_deg;   ///< continued the same way; 0 where commanded is 0
  std::vector<double> residual_deg;   ///< measured - slope * commanded
  double slope = 1.0;                 ///< measured turn per commanded turn; negative: reversed
  double slope_error = 0.0;           ///< standard error
  double offset_deg = 0.0;            ///< of the measured angles as given, where commanded is 0
  double rms_deg = 0.0;               ///< of the residuals
};

/// Robust line (Huber weights, iterated; Huber & Ronchetti 2009, ch. 7) through the angles of
/// successive stops. Both lists are known up to full turns; from stop to stop the table is taken
/// to have turned the shorter way the command says, or against it where that fits better.
/// \pre at least 3 stops, the same number of both angles
TurnRegression regress_turns(const std::vector<double>& commanded_deg,
                             const std::vector<double>& measured_deg);

}  // namespace skullstation
