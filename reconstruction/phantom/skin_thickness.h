#pragma once

#include <span>
#include <string_view>

namespace skullstation {

/// One pair of landmarks of the T-Table: how far the skin lies from the bone, and in which
/// direction it is measured.
struct TissueDepth {
  std::string_view bone;  ///< the skull's landmark, without side (skull_landmarks.h)
  bool bilateral;
  double mean_mm;
  double sd_mm;
  double direction[3];  ///< from bone to skin, on the left side; of any length
};

/// Soft tissue thickness of adults, sexes pooled: Hona & Stephan 2023 (means and SDs rounded to
/// 0.5 mm), at the landmarks of Caple & Stephan 2016. Directions are those in which the landmarks
/// are customarily probed: along the skin's normal, in the sagittal plane for median ones.
std::span<const TissueDepth> tissue_depths();

}  // namespace skullstation
