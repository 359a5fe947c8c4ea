#pragma once

#include <span>
#include <string_view>

#include "reconstruction/phantom/stroke.h"

namespace skullstation {

/// One line of the tables: a stroke in plain numbers, and the part of the skull it belongs to.
/// A tooth's strokes are named by jaw and kind ("upper canine", "lower molar 2"): paired, so one
/// line makes the left and the right tooth.
struct StrokeRow {
  std::string_view part;
  Stroke::Tool tool;
  Stroke::Form form;
  bool paired;
  double center_mm[3];
  double half_size_mm[3];
  double rotation_deg[3];
  double rounding_mm;
  double blend_mm;
};

/// The canonical adult skull in the anatomical frame, in the order of modelling. Origin of the
/// numbers: docs/phantom.md.
std::span<const StrokeRow> cranium_strokes();
std::span<const StrokeRow> mandible_strokes();

}  // namespace skullstation
