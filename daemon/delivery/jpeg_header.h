#pragma once

#include <optional>
#include <string_view>

namespace skullstation {

struct JpegHeader {
  int rows = 0;
  int columns = 0;
  int channels = 0;  ///< 1 or 3
  bool chroma_is_halved = false;
};

/// What a baseline JPEG file (8 bits, Huffman, one frame) says of itself; nothing for any other
/// file, which DICOM's JPEG Baseline transfer syntax could not carry.
std::optional<JpegHeader> baseline_jpeg_header(std::string_view bytes);

}  // namespace skullstation
