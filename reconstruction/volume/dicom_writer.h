#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

struct DicomWriteOptions {
  /// Written as Patient's Name and ID; made-up words, never a person's.
  std::string patient_name = "ANONYMOUS";
  std::string patient_id = "ANONYMOUS";
  std::string series_description;
  int series_number = 1;
  /// 16-bit signed as they are, or unsigned 12-bit with an intercept of -1024, as most scanners
  /// store them (values from -1024 to 3071).
  bool twelve_bit = false;
};

/// Writes a valid CT Image Storage series (DICOM PS3.3 A.3), explicit VR little endian, one file
/// per slice (IM_0001.dcm, ...), into a folder that must not exist yet; it appears whole or not at
/// all. UIDs are made from the content, so that the same volume and options give the same bytes.
/// Fails with `usage` for a left-handed grid, or values that 12 bits don't hold when asked for
/// them.
Result<void> write_dicom_series(const Volume& volume, const std::filesystem::path& folder,
                                const DicomWriteOptions& options = {});

}  // namespace skullstation
