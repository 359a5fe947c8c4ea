#pragma once

#include <span>
#include <string_view>

#include "reconstruction/phantom/skin_tube.h"

namespace skullstation {

/// One push of the thumb: the skin comes forward by `height_mm` at the centre of the dab, less and
/// less towards its radius: height * (1 - (r / radius)^2)^3. A dab off the midline comes with its
/// mirror image.
struct Dab {
  double center_mm[3];
  double radius_mm;
  double height_mm;
};

/// A tube that is added to or carved out of what was made before it, and the part of the head it
/// makes.
struct TubeRow {
  enum class Tool { add, carve };

  std::string_view part;
  Tool tool;
  bool paired;  ///< also as its mirror image in the midsagittal plane x = 0
  double blend_mm;
  std::span<const TubePoint> points;
};

/// The canonical adult head in the anatomical frame, in the order of modelling: first the rough
/// forms, then all dabs at once, then the fine features (lids, lips, nostrils). Origin of the
/// numbers: docs/phantom/skin.md.
std::span<const TubeRow> skin_rough_forms();
std::span<const Dab> skin_dabs();
std::span<const TubeRow> skin_features();

}  // namespace skullstation
