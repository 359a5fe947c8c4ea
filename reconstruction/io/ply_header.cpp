#include "reconstruction/io/ply_header.h"

#include <fmt/format.h>

#include "reconstruction/io/text_lines.h"

namespace skullstation {

using Encoding = PlyHeader::Encoding;
using Scalar = PlyHeader::Scalar;
using Property = PlyHeader::Property;
using Element = PlyHeader::Element;

namespace {

std::optional<Scalar> scalar_from_name(std::string_view name) {
  if (name == "char" || name == "int8") return Scalar::int8;
  if (name == "uchar" || name == "uint8") return Scalar::uint8;
  if (name == "short" || name == "int16") return Scalar::int16;
  if (name == "ushort" || name == "uint16") return Scalar::uint16;
  if (name == "int" || name == "int32") return Scalar::int32;
  if (name == "uint" || name == "uint32") return Scalar::uint32;
  if (name == "float" || name == "float32") return Scalar::float32;
  if (name == "double" || name == "float64") return Scalar::float64;
  return std::nullopt;
}

std::optional<Property> parse_property(const std::vector<std::string_view>& words) {
  Property property;
  if (words.size() == 5 && words[1] == "list") {
    const auto count = scalar_from_name(words[2]);
    const auto type = scalar_from_name(words[3]);
    if (!count || !type || is_float(*count)) return std::nullopt;
    property = {std::string(words[4]), *type, *count};
  } else {
    if (words.size() != 3) return std::nullopt;
    const auto type = scalar_from_name(words[1]);
    if (!type) return std::nullopt;
    property = {std::string(words[2]), *type, std::nullopt};
  }
  return property;
}

}  // namespace

std::size_t size_of(Scalar type) {
  switch (type) {
    case Scalar::int8:
    case Scalar::uint8: return 1;
    case Scalar::int16:
    case Scalar::uint16: return 2;
    case Scalar::int32:
    case Scalar::uint32:
    case Scalar::float32: return 4;
    case Scalar::float64: return 8;
  }
  return 0;
}

bool is_float(Scalar type) { return type == Scalar::float32 || type == Scalar::float64; }

int PlyHeader::Element::find(std::string_view property) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property) return static_cast<int>(i);
  }
  return -1;
}

double PlyHeader::Element::smallest_size(Encoding file_encoding) const {
  double record = 0.0;
  for (const Property& property : properties) {
    record += file_encoding == Encoding::ascii
                  ? 2.0
                  : static_cast<double>(size_of(property.list_count.value_or(property.type)));
  }
  return record * static_cast<double>(count);
}

Result<PlyHeader> parse_ply_header(std::string_view bytes, std::string_view name) {
  PlyHeader header;
  bool format_seen = false;
  for (;;) {
    const std::size_t end = bytes.find('\n', header.size);
    const std::string place = fmt::format("line {}", header.lines + 1);
    if (end == std::string_view::npos) {
      return bad_file(name, place, "the PLY header has no end_header line");
    }
    const auto words = words_of(bytes.substr(header.size, end - header.size));
    header.size = end + 1;
    ++header.lines;
    if (header.lines == 1) {
      if (words.size() != 1 || words[0] != "ply") return bad_file(name, place, "not a PLY file");
      continue;
    }
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3 && words[2] == "1.0") {
      format_seen = true;
      if (words[1] == "ascii") {
        header.encoding = Encoding::ascii;
      } else if (words[1] == "binary_little_endian") {
        header.encoding = Encoding::little_endian;
      } else if (words[1] == "binary_big_endian") {
        header.encoding = Encoding::big_endian;
      } else {
        return bad_file(name, place, fmt::format("unknown format \"{}\"", words[1]));
      }
    } else if (words[0] == "element" && words.size() == 3) {
      Element element{std::string(words[1]), 0, {}};
      if (!parse_number(words[2], element.count)) {
        return bad_file(name, place, fmt::format("\"{}\" is not a count", words[2]));
      }
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && !header.elements.empty()) {
      const auto property = parse_property(words);
      if (!property) return bad_file(name, place, "a property needs a known type and a name");
      header.elements.back().properties.push_back(*property);
    } else {
      return bad_file(name, place, fmt::format("unexpected \"{}\" in the header", words[0]));
    }
  }
  if (!format_seen) return bad_file(name, "line 2", "the format line is missing");
  return header;
}

}  // namespace skullstation
