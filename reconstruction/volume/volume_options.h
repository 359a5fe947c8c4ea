#pragma once

#include <optional>
#include <string>

namespace skullstation {

enum class LengthUnit { as_declared, millimetre, metre, micrometre };

/// How a volume is read. Nothing that a file leaves open is guessed: where an option is needed, the
/// error names it.
struct VolumeReadOptions {
  /// Which series of a DICOM folder: its UID, number or description. Empty: the only one there is.
  std::string series;
  /// Keep patient name, ID, dates and UIDs; they are dropped otherwise.
  bool keep_identity = false;
  /// For files that declare no unit of length, or a wrong one.
  LengthUnit length_unit = LengthUnit::as_declared;
  /// For files that state no orientation: take i, j, k as left, posterior, superior.
  bool assume_patient_axes = false;
  /// Added to every value of a file that holds shifted Hounsfield units.
  std::optional<int> hu_offset;
  /// Find that offset (0, -1000 or -1024) by the peak that the air round the head makes.
  bool infer_hu_offset = false;
};

}  // namespace skullstation
