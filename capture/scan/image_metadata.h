#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace skullstation {

/// What an image file tells about itself (EXIF 2.32), for every program that is not ours.
struct ImageMetadata {
  std::string description;    ///< case, pass, camera, angle
  std::string camera_model;   ///< as the device says
  std::string camera_serial;  ///< empty if it has none
  UtcTime captured;
  std::optional<std::chrono::microseconds> exposure;
  std::optional<double> focal_length_mm;
  /// Focal length whose horizontal field of view on a 36 mm wide film is the same; photogrammetry
  /// programs start from it.
  std::optional<double> focal_length_35mm;
};

/// The PNG or JPEG file's bytes with the metadata in them; pixels are untouched. Fails (no_result)
/// if the library that writes EXIF refuses.
Result<std::string> with_metadata(const std::string& image_file, const ImageMetadata& metadata);

}  // namespace skullstation
