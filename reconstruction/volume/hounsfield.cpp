#include "reconstruction/volume/hounsfield.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace skullstation {

namespace {

constexpr int air_hu = -1000;
constexpr int tolerance_hu = 60;

void shift(Volume& volume, int offset) {
  for (std::int16_t& hu : volume.hu) {
    hu = static_cast<std::int16_t>(std::clamp<int>(hu + offset,
                                                   std::numeric_limits<std::int16_t>::min(),
                                                   std::numeric_limits<std::int16_t>::max()));
  }
}

}  // namespace

std::optional<int> air_peak(const Volume& volume) {
  constexpr int lowest = std::numeric_limits<std::int16_t>::min();
  constexpr int bin = 4;
  std::vector<std::size_t> histogram(65536 / bin, 0);
  for (const std::int16_t hu : volume.hu) {
    ++histogram[static_cast<std::size_t>((hu - lowest) / bin)];
  }
  // Padding outside the scanner's round field lies far below air, at one value: the peak that
  // counts is the highest one from which tissue is 800 to 1300 HU away.
  std::size_t best = histogram.size();
  for (std::size_t air = 0; air + 1300 / bin < histogram.size(); ++air) {
    if (histogram[air] < volume.hu.size() / 50) continue;
    std::size_t tissue = 0;
    for (std::size_t t = air + 900 / bin; t < air + 1300 / bin; ++t) tissue += histogram[t];
    if (tissue < volume.hu.size() / 50) continue;
    if (best == histogram.size() || histogram[air] > histogram[best]) best = air;
  }
  if (best == histogram.size()) return std::nullopt;
  return lowest + static_cast<int>(best) * bin + bin / 2;
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
