#include "reconstruction/volume/dicom_pixels.h"

#include <fmt/format.h>
#include <gdcmImageReader.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <array>
#include <bit>
#include <sstream>

namespace skullstation {

namespace {

constexpr std::array<std::string_view, 7> known_syntaxes = {
    "1.2.840.10008.1.2.5",     // RLE
    "1.2.840.10008.1.2.4.57",  // JPEG lossless, process 14
    "1.2.840.10008.1.2.4.70",  // JPEG lossless, process 14, selection value 1
    "1.2.840.10008.1.2.4.80",  // JPEG-LS lossless
    "1.2.840.10008.1.2.4.81",  // JPEG-LS near lossless
    "1.2.840.10008.1.2.4.90",  // JPEG 2000 lossless
    "1.2.840.10008.1.2.4.91"   // JPEG 2000
};

static_assert(std::endian::native == std::endian::little, "GDCM gives words in machine order");

}  // namespace

Result<std::string> decompress_dicom_pixels(const std::string& file_bytes,
                                            std::string_view transfer_syntax_uid,
                                            const std::string& name) {
  if (std::ranges::find(known_syntaxes, transfer_syntax_uid) == known_syntaxes.end()) {
    return fail(ErrorKind::bad_input, name,
                fmt::format("transfer syntax {} is not read", transfer_syntax_uid),
                "export the series uncompressed or lossless");
  }
  const auto broken = [&](std::string_view why) {
    return fail(ErrorKind::bad_input, name,
                fmt::format("its compressed pixels can't be decoded{}", why),
                "copy the series again");
  };
  // GDCM tells the terminal too what it then returns as an error.
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  gdcm::Trace::DebugOff();
  try {
    std::istringstream stream(file_bytes);
    gdcm::ImageReader reader;
    reader.SetStream(stream);
    if (!reader.Read()) return broken("");
    const gdcm::Image& image = reader.GetImage();
    std::string pixels(image.GetBufferLength(), '\0');
    if (!image.GetBuffer(pixels.data())) return broken("");
    return pixels;
  } catch (const std::exception& error) {
    return broken(fmt::format(" ({})", error.what()));
  }
}

}  // namespace skullstation
