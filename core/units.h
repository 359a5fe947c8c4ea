#pragma once

#include <cmath>
#include <numbers>

namespace skullstation {

/// Angles are degrees in every name, flag and file; radians appear inside formulas only.
constexpr double radians(double angle_deg) { return angle_deg * std::numbers::pi / 180.0; }
constexpr double degrees(double angle_rad) { return angle_rad * 180.0 / std::numbers::pi; }

/// The same direction in [0, 360).
inline double wrapped_deg(double angle_deg) {
  const double wrapped = std::fmod(angle_deg, 360.0);
  return wrapped < 0.0 ? wrapped + 360.0 : wrapped;
}

/// Shortest signed turn from `from_deg` to `to_deg`, in [-180, 180).
inline double turn_deg(double from_deg, double to_deg) {
  return wrapped_deg(to_deg - from_deg + 180.0) - 180.0;
}

}  // namespace skullstation
