#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// One slice of a series: where the centre of its first pixel lies in the patient.
struct SlicePlace {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  std::string name;  ///< its file, for messages
};

/// How parallel slices lie on each other.
struct SliceStack {
  std::vector<int> order;   ///< slices from the lowest along the normal
  double spacing_mm = 0.0;  ///< mean gap along the normal
  /// Gaps along the normal differ: the slices have to be interpolated at equal steps.
  bool uneven = false;
  double smallest_gap_mm = 0.0;
  double largest_gap_mm = 0.0;
  /// Angle between the normal and the line through the slices' corners: the gantry was tilted,
  /// and every slice has to be shifted in its plane.
  double tilt_deg = 0.0;
  std::vector<double> height_mm;          ///< along the normal, in `order`, first 0
  std::vector<Eigen::Vector2d> drift_mm;  ///< in the plane (row, column direction), first 0
};

/// Sorts slices by their position along `row_direction` x `column_direction` (unit vectors) and
/// looks at the gaps. A rounding error of 2 % of a gap (at least 0.02 mm) is let pass. Fails with
/// `bad_input` for fewer than two slices, two at one place, a missing slice (an isolated gap of a
/// whole multiple; its position is named), gaps above 5 mm among uneven ones, and corners that
/// don't lie on a line.
Result<SliceStack> stack_slices(const std::vector<SlicePlace>& slices,
                                const Eigen::Vector3d& row_direction,
                                const Eigen::Vector3d& column_direction);

}  // namespace skullstation
