#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "capture/scan/image_quality.h"

namespace skullstation {

Result<void> QualityGates::validate() const {
  const auto wrong = [](const char* name, double value, const char* expected) {
    return fail(ErrorKind::usage, fmt::format("quality gates: {}", name),
                fmt::format("must be {}, not {}", expected, value));
  };
  const std::pair<const char*, double> not_negative[] = {
      {"min_sharpness", min_sharpness},
      {"max_motion_px", max_motion_px},
      {"views_for_median", views_for_median},
      {"min_board_corners", min_board_corners},
  };
  for (const auto& [name, value] : not_negative) {
    if (!(value >= 0.0)) return wrong(name, value, "0 or more");
  }
  const std::pair<const char*, double> percentages[] = {
      {"max_clipped_percent", max_clipped_percent},
      {"max_dark_percent", max_dark_percent},
      {"max_border_percent", max_border_percent},
      {"min_specimen_percent", min_specimen_percent},
  };
  for (const auto& [name, value] : percentages) {
    if (!(value >= 0.0 && value <= 100.0)) return wrong(name, value, "from 0 to 100");
  }
  if (!(min_sharpness_of_median >= 0.0 && min_sharpness_of_median <= 1.0)) {
    return wrong("min_sharpness_of_median", min_sharpness_of_median, "from 0 to 1");
  }
  if (!(min_mean_level >= 0.0 && min_mean_level < max_mean_level && max_mean_level <= 255.0)) {
    return wrong("min_mean_level", min_mean_level, "below max_mean_level, both from 0 to 255");
  }
  return {};
}

std::optional<std::string> failed_gate(const ViewQuality& quality, const QualityGates& gates,
                                       std::span<const double> accepted_sharpness,
                                       bool board_expected) {
  // What explains the others comes first: without a specimen nothing else means anything.
  if (quality.specimen_percent < gates.min_specimen_percent) {
    return fmt::format("no specimen seen: it covers {:.2f} % of the frame, {:.2f} are needed",
                       quality.specimen_percent, gates.min_specimen_percent);
  }
  if (quality.clipped_percent > gates.max_clipped_percent) {
    return fmt::format("overexposed: {:.1f} % of the specimen is clipped, {:.1f} are allowed",
                       quality.clipped_percent, gates.max_clipped_percent);
  }
  if (quality.mean_level > gates.max_mean_level) {
    return fmt::format("overexposed: the specimen's mean level is {:.0f}, {:.0f} is allowed",
                       quality.mean_level, gates.max_mean_level);
  }
  if (quality.dark_percent > gates.max_dark_percent) {
    return fmt::format("underexposed: {:.1f} % of the specimen is black, {:.1f} are allowed",
                       quality.dark_percent, gates.max_dark_percent);
  }
  if (quality.mean_level < gates.min_mean_level) {
    return fmt::format("underexposed: the specimen's mean level is {:.0f}, {:.0f} is needed",
                       quality.mean_level, gates.min_mean_level);
  }
  if (quality.border_percent > gates.max_border_percent) {
    return fmt::format(
        "specimen cut off: it touches {:.1f} % of the frame's border, {:.1f} are "
        "allowed",
        quality.border_percent, gates.max_border_percent);
  }
  if (quality.motion_px > gates.max_motion_px) {
    return fmt::format("moving: {:.2f} px between two frames, {:.2f} are allowed",
                       quality.motion_px, gates.max_motion_px);
  }
  if (board_expected && quality.board_corners < gates.min_board_corners) {
    return fmt::format("board not visible: {} corners seen, {} are needed", quality.board_corners,
                       gates.min_board_corners);
  }
  if (quality.sharpness < gates.min_sharpness) {
    return fmt::format("not sharp: {:.3f}, {:.3f} is needed", quality.sharpness,
                       gates.min_sharpness);
  }
  if (!accepted_sharpness.empty() &&
      static_cast<int>(accepted_sharpness.size()) >= gates.views_for_median) {
    std::vector<double> values(accepted_sharpness.begin(), accepted_sharpness.end());
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    const double needed = gates.min_sharpness_of_median * *middle;
    if (quality.sharpness < needed) {
      return fmt::format("not sharp: {:.3f}, {:.3f} is needed ({:.0f} % of this camera's median)",
                         quality.sharpness, needed, 100.0 * gates.min_sharpness_of_median);
    }
  }
  return std::nullopt;
}

}  // namespace skullstation
