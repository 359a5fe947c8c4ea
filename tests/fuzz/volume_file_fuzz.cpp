#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "reconstruction/volume/volume_file.h"

/// The first byte chooses the format, the rest is the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array<const char*, 4> extensions = {".nii", ".nii.gz", ".nrrd", ".mha"};
  if (size == 0) return 0;
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() /
      ("volume_fuzz_" + std::to_string(::getpid()) + extensions[data[0] % extensions.size()]);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
  skullstation::VolumeReadOptions options;
  options.assume_patient_axes = true;
  options.length_unit = skullstation::LengthUnit::millimetre;
  const auto volume = skullstation::read_volume(path, options);
  std::filesystem::remove(path);
  if (volume && volume->hu.size() != volume->grid.count()) std::abort();
  return 0;
}
