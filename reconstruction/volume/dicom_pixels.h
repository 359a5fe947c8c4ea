#pragma once

#include <string>
#include <string_view>

#include "core/result.h"

namespace skullstation {

/// Decompresses the pixel data of a whole DICOM file through GDCM: RLE, JPEG lossless, JPEG-LS,
/// JPEG 2000. Gives 16-bit words, little endian, all frames one after the other. Fails with
/// `bad_input` for other transfer syntaxes and broken streams.
Result<std::string> decompress_dicom_pixels(const std::string& file_bytes,
                                            std::string_view transfer_syntax_uid,
                                            const std::string& name);

}  // namespace skullstation
