#include "capture/simulation/table_map.h"

#include <cstddef>
#include <utility>

namespace skullstation {

TableMap::TableMap(std::vector<float> values) : values_(std::move(values)) {}

float TableMap::at(double x_table, double y_table) const {
  if (values_.empty()) return 1.0F;
  const double x = x_table / spacing_mm + size / 2;
  const double y = y_table / spacing_mm + size / 2;
  if (!(x >= 0.0 && y >= 0.0 && x < size - 1 && y < size - 1)) return 1.0F;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const auto u = static_cast<float>(x - column);
  const auto v = static_cast<float>(y - row);
  const float* corner = values_.data() + static_cast<std::size_t>(row) * size + column;
  return (1.0F - v) * ((1.0F - u) * corner[0] + u * corner[1]) +
         v * ((1.0F - u) * corner[size] + u * corner[size + 1]);
}

TableMap TableMap::smoothed() const {
  std::vector<float> result = values_;
  for (int row = 1; row + 1 < size; ++row) {
    for (int column = 1; column + 1 < size; ++column) {
      const std::size_t at = static_cast<std::size_t>(row) * size + column;
      const auto across = [&](std::size_t i) {
        return 0.25F * values_[i - 1] + 0.5F * values_[i] + 0.25F * values_[i + 1];
      };
      result[at] = 0.25F * across(at - size) + 0.5F * across(at) + 0.25F * across(at + size);
    }
  }
  return TableMap(std::move(result));
}

}  // namespace skullstation
