#include "reconstruction/volume/hounsfield.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

namespace skullstation {

namespace {

constexpr int air_hu = -1000;
constexpr int tolerance_hu = 60;
constexpr int padding_gap_hu = 200;
constexpr int highest_padding_hu = -1500;

void shift(Volume& volume, int offset) {
  for (std::int16_t& hu : volume.hu) {
    hu = static_cast<std::int16_t>(std::clamp<int>(hu + offset,
                                                   std::numeric_limits<std::int16_t>::min(),
                                                   std::numeric_limits<std::int16_t>::max()));
  }
}

constexpr int lowest_hu = std::numeric_limits<std::int16_t>::min();
constexpr int bin_hu = 4;
using Histogram = std::vector<std::size_t>;

/// The highest peak from which tissue is 900 to 1300 HU away.
std::optional<int> peak_below_tissue(const Histogram& histogram, std::size_t voxels) {
  std::optional<std::size_t> best;
  for (std::size_t air = 0; air + 1300 / bin_hu < histogram.size(); ++air) {
    if (histogram[air] < voxels / 50) continue;
    std::size_t tissue = 0;
    for (std::size_t t = air + 900 / bin_hu; t < air + 1300 / bin_hu; ++t) tissue += histogram[t];
    if (tissue < voxels / 50) continue;
    if (!best || histogram[air] > histogram[*best]) best = air;
  }
  if (!best) return std::nullopt;
  return lowest_hu + static_cast<int>(*best) * bin_hu + bin_hu / 2;
}

/// Without the padding outside the scanner's round field, which is one value far below all others
/// and below any air: air stands to padding of -2000 as tissue stands to air.
Histogram without_padding(Histogram histogram) {
  const auto filled = [](std::size_t count) { return count > 0; };
  const auto first = std::ranges::find_if(histogram, filled);
  if (first == histogram.end()) return histogram;
  const auto second = std::find_if(first + 1, histogram.end(), filled);
  const auto value_hu = lowest_hu + bin_hu * static_cast<int>(first - histogram.begin());
  if (value_hu < highest_padding_hu && second - first > padding_gap_hu / bin_hu) *first = 0;
  return histogram;
}

}  // namespace

std::optional<int> air_peak(const Volume& volume) {
  Histogram histogram(65536 / bin_hu, 0);
  for (const std::int16_t hu : volume.hu) {
    ++histogram[static_cast<std::size_t>((hu - lowest_hu) / bin_hu)];
  }
  return peak_below_tissue(without_padding(std::move(histogram)), volume.hu.size());
}

Result<void> apply_hu_offset(Volume& volume, const VolumeReadOptions& options,
                             const std::string& name) {
  if (options.hu_offset) {
    shift(volume, *options.hu_offset);
    volume.info.warnings.push_back(
        fmt::format("{} was added to the file's values to make them Hounsfield units, as asked",
                    *options.hu_offset));
    return {};
  }
  if (!options.infer_hu_offset) return {};
  const auto air = air_peak(volume);
  int best = 0;
  for (const int offset : {-1000, -1024}) {
    if (air && std::abs(*air + offset - air_hu) < std::abs(*air + best - air_hu)) best = offset;
  }
  if (!air || std::abs(*air + best - air_hu) > tolerance_hu) {
    return fail(
        ErrorKind::bad_input, name,
        air ? fmt::format("its air lies at {}, which no usual offset brings to -1000 HU", *air)
            : std::string("no air is seen in it by which to find its Hounsfield offset"),
        "give the offset yourself (--hu-offset N)");
  }
  shift(volume, best);
  volume.info.warnings.push_back(fmt::format(
      "the Hounsfield offset {} was inferred from the air at {}; check it with the scan's source",
      best, *air));
  return {};
}

}  // namespace skullstation
