#include <cstddef>
#include <cstdint>
#include <string_view>

#include "reconstruction/volume/dicom_elements.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto file = skullstation::parse_dicom(bytes, "fuzz.dcm");
  if (!file) return 0;
  // Every view must lie inside the bytes; the sanitizer sees one that does not.
  unsigned sum = 0;
  for (const char c : file->data.bytes(skullstation::DicomFile::pixel_data).value_or("")) {
    sum += static_cast<unsigned char>(c);
  }
  for (const auto& item : file->data.items(0x52009230)) {
    sum += static_cast<unsigned>(item.text(0x00200032).size());
  }
  return sum == 0xffffffff ? -1 : 0;
}
