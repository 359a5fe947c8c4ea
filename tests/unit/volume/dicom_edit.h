#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "reconstruction/volume/volume.h"

namespace skullstation::testing {

/// Opens a DICOM file, spoils it in one place and saves it: what other scanners and broken copies
/// do to files.
class DicomEdit {
 public:
  explicit DicomEdit(const std::filesystem::path& path);
  ~DicomEdit();
  DicomEdit(const DicomEdit&) = delete;
  DicomEdit& operator=(const DicomEdit&) = delete;

  /// Sets a text element; its value representation is the dictionary's.
  void set(std::uint16_t group, std::uint16_t element, std::string value);
  void remove(std::uint16_t group, std::uint16_t element);
  /// Sets the bits of each 16 that 12-bit pixels don't use.
  void fill_unused_bits();
  void halve_pixels();
  void save(const std::filesystem::path& path);

 private:
  struct File;
  std::unique_ptr<File> file_;
};

enum class TransferSyntax { jpeg_lossless, rle, jpeg_ls_lossless };

/// Compresses the file's pixels in place.
void transcode(const std::filesystem::path& path, TransferSyntax syntax);

/// Writes the slices in the given order as the frames of one Enhanced CT Image.
void write_enhanced_ct(const Volume& volume, const std::filesystem::path& path,
                       const std::vector<int>& order);

}  // namespace skullstation::testing
