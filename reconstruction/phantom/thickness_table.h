#pragma once

#include <span>
#include <string_view>

namespace skullstation {

/// Facial soft tissue thickness of adults between a landmark of the bone and its counterpart on the
/// skin [mm], and what share of its variation goes with the person's fatness, sex and age.
struct TissueThickness {
  std::string_view pair;  ///< abbreviation, as "g-g'"
  std::string_view bone;  ///< landmark's name without side; the skin's is that with " skin"
  bool bilateral;
  double mean_mm;
  double sd_mm;
  double direction[3];  ///< from bone to skin, on the left side; of any length
  /// Correlation of the thickness (of its logarithm) with the adiposity factor, with being male,
  /// with age.
  double with_adiposity;
  double with_male;
  double with_age;
};

/// Directions are those in which the landmarks are customarily probed: along the skin's normal, in
/// the sagittal plane for median ones. Means and SDs: pooled adults, T-Table of Hona & Stephan
/// 2024, as transcribed to half a millimetre by a second hand. The correlations are our own
/// assumption, in the order that De Greef et al. 2009 and Shui et al. 2016 report: fatness leads,
/// most at cheek and jaw; men's tissue is a little thicker; age matters least.
std::span<const TissueThickness> thickness_table();

}  // namespace skullstation
