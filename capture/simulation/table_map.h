#pragma once

#include <vector>

namespace skullstation {

/// A quantity over the table's top that changes slowly: a square grid in the table frame, bilinear
/// between its points, 1 outside.
class TableMap {
 public:
  static constexpr int size = 225;
  static constexpr double spacing_mm = 2.5;

  TableMap() = default;
  /// All points at once, row by row, y upwards: size x size values.
  explicit TableMap(std::vector<float> values);

  /// Place of a row or a column [mm].
  static double place_mm(int index) { return (index - size / 2) * spacing_mm; }

  float at(double x_table, double y_table) const;

  /// The map averaged over 3 x 3 points with binomial weights: takes the noise of a few rays out
  /// of a penumbra.
  TableMap smoothed() const;

 private:
  std::vector<float> values_;  // empty: 1 everywhere
};

}  // namespace skullstation
