#pragma once

#include <cstdint>
#include <string_view>

#include "core/image.h"
#include "core/result.h"

namespace skullstation {

/// A JPEG file as grey or RGB. Stricter than libjpeg's callers usually are: where the library
/// would warn and fill the rest with grey (a file cut short, a sector lost), this is an error that
/// names the file. A few stray bytes between segments, which some cameras write, are accepted.
Result<Image8> decode_jpeg_file(std::string_view bytes, std::string_view name,
                                std::int64_t max_pixels);

}  // namespace skullstation
