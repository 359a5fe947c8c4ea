#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// A DICOM tag: group in the upper 16 bits, element in the lower.
using DicomTag = std::uint32_t;

/// The elements of a DICOM data set (PS3.5 section 7), as views into the file's bytes, which must
/// outlive it. Every length was checked against the file's size.
class DicomDataSet {
 public:
  /// The element's text without padding; empty if it is absent.
  std::string text(DicomTag tag) const;
  /// All the element's decimal or integer strings; nothing unless there are `count` of them, all
  /// finite numbers.
  std::optional<std::vector<double>> decimals(DicomTag tag, std::size_t count) const;
  std::optional<double> decimal(DicomTag tag) const;
  /// A single unsigned short.
  std::optional<int> number(DicomTag tag) const;
  /// The items of a sequence; none if it is absent.
  const std::vector<DicomDataSet>& items(DicomTag tag) const;
  /// The bytes of an element that is no sequence; nothing if it is absent.
  std::optional<std::string_view> bytes(DicomTag tag) const;

 private:
  friend class DicomParser;
  struct Element {
    DicomTag tag = 0;
    std::string_view value;
    std::vector<DicomDataSet> items;
  };
  const Element* find(DicomTag tag) const;

  std::vector<Element> elements_;
};

/// A DICOM file taken apart.
struct DicomFile {
  std::string transfer_syntax_uid;
  DicomDataSet data;
  bool encapsulated_pixels = false;  ///< compressed, in fragments

  static constexpr DicomTag pixel_data = 0x7fe00010;
};

/// True if the bytes begin as a DICOM file does: "DICM" at byte 128 (PS3.10).
bool has_dicom_preamble(std::string_view bytes);

/// Takes a file apart: little endian, explicit or implicit value representations, sequences of
/// either kind of length to a depth of 16. Fails with `bad_input`, naming the byte, where a length
/// leads out of the file, and for big endian and deflated files, which no CT scanner writes.
Result<DicomFile> parse_dicom(std::string_view bytes, std::string_view name);

}  // namespace skullstation
