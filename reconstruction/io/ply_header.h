#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// What stands before the data of a PLY file, as its header declares it.
struct PlyHeader {
  enum class Encoding { ascii, little_endian, big_endian };
  enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

  struct Property {
    std::string name;
    Scalar type = Scalar::float32;
    std::optional<Scalar> list_count;  ///< set for lists: the type of the length
  };

  struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;

    /// Index of the property, -1 if there is none of this name.
    int find(std::string_view property) const;
    /// Least bytes that the element's records can take, whatever their lists hold.
    double smallest_size(Encoding encoding) const;
  };

  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t size = 0;  ///< bytes up to and including "end_header\n"
  int lines = 0;
};

std::size_t size_of(PlyHeader::Scalar type);
bool is_float(PlyHeader::Scalar type);

/// Fails with the line of the first thing that is not PLY 1.0; `name` stands for the file.
Result<PlyHeader> parse_ply_header(std::string_view bytes, std::string_view name);

}  // namespace skullstation
