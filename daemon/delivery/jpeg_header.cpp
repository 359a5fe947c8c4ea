#include "daemon/delivery/jpeg_header.h"

namespace skullstation {

std::optional<JpegHeader> baseline_jpeg_header(std::string_view bytes) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  const auto word = [&](std::size_t i) { return byte(i) * 256 + byte(i + 1); };
  if (bytes.size() < 4 || word(0) != 0xffd8) return std::nullopt;
  for (std::size_t place = 2; place + 4 <= bytes.size();) {
    if (byte(place) != 0xff) return std::nullopt;
    const int marker = byte(place + 1);
    if (marker == 0xff) {  // a fill byte
      ++place;
      continue;
    }
    const auto length = static_cast<std::size_t>(word(place + 2));
    if (length < 2 || place + 2 + length > bytes.size()) return std::nullopt;
    const bool frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) {
      // ITU-T T.81, B.2.2: length, precision, lines, samples per line, components.
      if (marker != 0xc0 || length < 8 || byte(place + 4) != 8) return std::nullopt;
      const JpegHeader header{word(place + 5), word(place + 7), byte(place + 9),
                              length >= 11 && byte(place + 11) != 0x11};
      const bool sound =
          header.rows > 0 && header.columns > 0 && (header.channels == 1 || header.channels == 3);
      return sound ? std::optional(header) : std::nullopt;
    }
    if (marker == 0xda) return std::nullopt;  // pixels before a frame
    place += 2 + length;
  }
  return std::nullopt;
}

}  // namespace skullstation
