#include "reconstruction/volume/slice_stack.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/median.h"
#include "core/units.h"

namespace skullstation {

namespace {

constexpr double largest_uneven_gap_mm = 5.0;
constexpr double least_tilt_deg = 0.1;

double rounding_mm(double gap_mm) { return std::max(0.02, 0.02 * gap_mm); }

tl::unexpected<Error> bad(const std::string& where, std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, where, std::move(what), std::move(advice));
}

/// Why a gap of this size among others of `usual_mm` means missing slices, or 0: how many.
int missing_in(double gap_mm, double usual_mm) {
  const double multiple = gap_mm / usual_mm;
  const double whole = std::round(multiple);
  return whole >= 2.0 && std::abs(multiple - whole) < 0.05 * whole ? static_cast<int>(whole) - 1
                                                                   : 0;
}

Result<void> check_gaps(const std::vector<SlicePlace>& slices, const Eigen::Vector3d& normal,
                        SliceStack& stack) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < stack.height_mm.size(); ++i) {
    gaps.push_back(stack.height_mm[i] - stack.height_mm[i - 1]);
  }
  const double usual_mm = median(gaps);
  const auto slice = [&](std::size_t i) -> const SlicePlace& {
    return slices[static_cast<std::size_t>(stack.order[i])];
  };
  std::size_t irregular = 0;
  std::size_t multiples = 0;
  std::size_t first_multiple = gaps.size();
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    if (gaps[i] < 1e-3) {
      return bad(slice(i + 1).name,
                 fmt::format("lies in the same place as {}: two acquisitions, or a file twice",
                             slice(i).name),
                 "leave one of them in the folder");
    }
    if (std::abs(gaps[i] - usual_mm) <= rounding_mm(usual_mm)) continue;
    ++irregular;
    if (missing_in(gaps[i], usual_mm) == 0) continue;
    ++multiples;
    first_multiple = std::min(first_multiple, i);
  }
  stack.spacing_mm = stack.height_mm.back() / static_cast<double>(gaps.size());
  stack.smallest_gap_mm = *std::ranges::min_element(gaps);
  stack.largest_gap_mm = *std::ranges::max_element(gaps);
  if (irregular == 0) return {};
  if (irregular == multiples && multiples <= std::max<std::size_t>(1, gaps.size() / 10)) {
    const SlicePlace& before = slice(first_multiple);
    const Eigen::Vector3d missing = before.position_mm + usual_mm * normal;
    return bad(
        before.name,
        fmt::format("{} missing above this one: ({:.2f}, {:.2f}, {:.2f}) mm, between it and "
                    "{}, which lies {:.2f} mm on where {:.2f} mm are usual",
                    missing_in(gaps[first_multiple], usual_mm) == 1 ? "a slice is" : "slices are",
                    missing.x(), missing.y(), missing.z(), slice(first_multiple + 1).name,
                    gaps[first_multiple], usual_mm),
        "copy the whole series again");
  }
  if (stack.largest_gap_mm > largest_uneven_gap_mm) {
    return bad(slice(0).name,
               fmt::format("the series has uneven gaps from {:.2f} to {:.2f} mm",
                           stack.smallest_gap_mm, stack.largest_gap_mm),
               fmt::format("gaps up to {:.0f} mm can be interpolated", largest_uneven_gap_mm));
  }
  stack.uneven = true;
  return {};
}

}  // namespace

Result<SliceStack> stack_slices(const std::vector<SlicePlace>& slices,
                                const Eigen::Vector3d& row_direction,
                                const Eigen::Vector3d& column_direction) {
  if (slices.size() < 2) {
    return bad(slices.empty() ? "series" : slices[0].name,
               fmt::format("a volume needs at least 2 slices, this series has {}", slices.size()));
  }
  const Eigen::Vector3d normal = row_direction.cross(column_direction);
  SliceStack stack;
  stack.order.resize(slices.size());
  std::iota(stack.order.begin(), stack.order.end(), 0);
  const auto place = [&](int slice) { return slices[static_cast<std::size_t>(slice)].position_mm; };
  std::ranges::stable_sort(
      stack.order, [&](int a, int b) { return place(a).dot(normal) < place(b).dot(normal); });
  const Eigen::Vector3d first = place(stack.order.front());
  for (const int slice : stack.order) {
    const Eigen::Vector3d from_first = place(slice) - first;
    stack.height_mm.push_back(from_first.dot(normal));
    stack.drift_mm.emplace_back(from_first.dot(row_direction), from_first.dot(column_direction));
  }
  if (const auto checked = check_gaps(slices, normal, stack); !checked) return forward(checked);

  const Eigen::Vector2d slope = stack.drift_mm.back() / stack.height_mm.back();
  for (std::size_t i = 0; i < stack.order.size(); ++i) {
    if ((stack.drift_mm[i] - stack.height_mm[i] * slope).norm() > 0.1) {
      return bad(slices[static_cast<std::size_t>(stack.order[i])].name,
                 "lies beside the line through the other slices' corners",
                 "the series mixes scans, or the table moved sideways");
    }
  }
  const double tilt_deg = degrees(std::atan(slope.norm()));
  if (tilt_deg >= least_tilt_deg) stack.tilt_deg = tilt_deg;
  return stack;
}

}  // namespace skullstation
