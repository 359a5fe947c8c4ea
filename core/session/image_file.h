#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/image.h"
#include "core/result.h"

namespace skullstation {

/// Reads PNG, JPEG or TIFF as 8-bit grey (1 channel) or RGB (3 channels), without turning it by
/// its EXIF orientation. Truncated or foreign files are errors that name the file.
Result<Image8> read_image(const std::filesystem::path& path);

/// The same from memory; `name` stands for the file in error messages.
Result<Image8> decode_image(std::string_view bytes, std::string_view name);

/// The file's bytes for an image of 1 or 3 channels.
std::string encode_png(const Image8& image);
/// `quality` from 1 to 100.
std::string encode_jpeg(const Image8& image, int quality);

}  // namespace skullstation
