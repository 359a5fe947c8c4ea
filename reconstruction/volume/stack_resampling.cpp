#include "reconstruction/volume/stack_resampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace skullstation {

namespace {

constexpr double air_hu = -1000.0;

std::int16_t rounded_hu(double value) {
  return static_cast<std::int16_t>(
      std::lround(std::clamp(value, double(std::numeric_limits<std::int16_t>::min()),
                             double(std::numeric_limits<std::int16_t>::max()))));
}

/// Cubic convolution with a = -1/2 (Keys 1981): weights of the samples at -1, 0, 1 and 2 for the
/// place `t` in [0, 1).
std::array<double, 4> cubic_weights(double t) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {0.5 * (-t3 + 2.0 * t2 - t), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
          0.5 * (-3.0 * t3 + 4.0 * t2 + t), 0.5 * (t3 - t2)};
}

/// A line of samples, `shift` of them farther on, air at both ends.
void shift_line(const std::vector<double>& from, double shift, std::vector<double>& to) {
  const double whole = std::floor(-shift);
  const auto weights = cubic_weights(-shift - whole);
  const auto size = static_cast<std::ptrdiff_t>(from.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    double value = 0.0;
    for (std::size_t tap = 0; tap < 4; ++tap) {
      const auto at = static_cast<std::ptrdiff_t>(i) + static_cast<std::ptrdiff_t>(whole) +
                      static_cast<std::ptrdiff_t>(tap) - 1;
      value += weights[tap] * (at >= 0 && at < size ? from[static_cast<std::size_t>(at)] : air_hu);
    }
    to[i] = value;
  }
}

}  // namespace

Volume straightened(const Volume& volume, const SliceStack& stack) {
  Eigen::Vector2d least = Eigen::Vector2d::Zero();
  Eigen::Vector2d most = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& drift : stack.drift_mm) {
    least = least.cwiseMin(drift);
    most = most.cwiseMax(drift);
  }
  const VoxelGrid& old = volume.grid;
  const Eigen::Vector2d spacing_mm = old.spacing_mm.head<2>();
  Volume result{old, {}, volume.info};
  VoxelGrid& grid = result.grid;
  for (int axis = 0; axis < 2; ++axis) {
    grid.size[axis] +=
        static_cast<int>(std::ceil((most[axis] - least[axis]) / spacing_mm[axis] - 1e-6));
  }
  grid.origin_mm += grid.direction.leftCols<2>() * least;
  result.hu.resize(grid.count());

  std::vector<double> line;
  std::vector<double> wide(static_cast<std::size_t>(grid.size.x()));
  std::vector<double> high(static_cast<std::size_t>(grid.size.y()));
  for (int k = 0; k < grid.size.z(); ++k) {
    const Eigen::Vector2d shift =
        (stack.drift_mm[static_cast<std::size_t>(k)] - least).cwiseQuotient(spacing_mm);
    // Rows first, then the columns of what came out.
    std::vector<double> rows(wide.size() * static_cast<std::size_t>(old.size.y()));
    for (int j = 0; j < old.size.y(); ++j) {
      const auto begin = volume.hu.begin() + static_cast<std::ptrdiff_t>(old.index(0, j, k));
      line.assign(begin, begin + old.size.x());
      shift_line(line, shift.x(), wide);
      std::ranges::copy(wide, rows.begin() + static_cast<std::ptrdiff_t>(
                                                 static_cast<std::size_t>(j) * wide.size()));
    }
    line.resize(static_cast<std::size_t>(old.size.y()));
    for (int i = 0; i < grid.size.x(); ++i) {
      for (std::size_t j = 0; j < line.size(); ++j) {
        line[j] = rows[j * wide.size() + static_cast<std::size_t>(i)];
      }
      shift_line(line, shift.y(), high);
      for (int j = 0; j < grid.size.y(); ++j) {
        result.at(i, j, k) = rounded_hu(high[static_cast<std::size_t>(j)]);
      }
    }
  }
  return result;
}

Volume evenly_spaced(const Volume& volume, const SliceStack& stack) {
  Volume result{volume.grid, {}, volume.info};
  VoxelGrid& grid = result.grid;
  const double total_mm = stack.height_mm.back();
  grid.size.z() = 1 + static_cast<int>(std::floor(total_mm / stack.smallest_gap_mm + 1e-6));
  grid.spacing_mm.z() = stack.smallest_gap_mm;
  result.hu.resize(grid.count());
  const std::size_t slice_size =
      static_cast<std::size_t>(grid.size.x()) * static_cast<std::size_t>(grid.size.y());
  std::size_t below = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    const double height_mm = k * grid.spacing_mm.z();
    while (below + 2 < stack.height_mm.size() && stack.height_mm[below + 1] <= height_mm) ++below;
    const double gap_mm = stack.height_mm[below + 1] - stack.height_mm[below];
    const double t = std::min(1.0, (height_mm - stack.height_mm[below]) / gap_mm);
    const std::int16_t* low = volume.hu.data() + below * slice_size;
    const std::int16_t* high = low + slice_size;
    std::int16_t* to = result.hu.data() + static_cast<std::size_t>(k) * slice_size;
    for (std::size_t i = 0; i < slice_size; ++i)
      to[i] = rounded_hu((1.0 - t) * low[i] + t * high[i]);
  }
  return result;
}

}  // namespace skullstation
