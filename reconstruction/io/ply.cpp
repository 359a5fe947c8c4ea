#include "reconstruction/io/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"

namespace skullstation {

namespace {

// ------------------------------------------------------------------------------------- header --

enum class Encoding { ascii, little_endian, big_endian };

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

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

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> list_count;  // set for lists: the type of the length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  int find(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i) {
      if (properties[i].name == property) return static_cast<int>(i);
    }
    return -1;
  }
};

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t size = 0;  // bytes up to and including "end_header\n"
  int lines = 0;
};

tl::unexpected<Error> bad(std::string_view name, std::string_view place, std::string what) {
  return fail(ErrorKind::bad_input, fmt::format("{}:{}", name, place), std::move(what));
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

template <class Number>
bool parse_number(std::string_view word, Number& number) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc{} && end == word.data() + word.size();
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

Result<Header> parse_header(std::string_view bytes, std::string_view name) {
  Header header;
  bool format_seen = false;
  for (;;) {
    const std::size_t end = bytes.find('\n', header.size);
    const std::string place = fmt::format("line {}", header.lines + 1);
    if (end == std::string_view::npos) {
      return bad(name, place, "the PLY header has no end_header line");
    }
    const auto words = words_of(bytes.substr(header.size, end - header.size));
    header.size = end + 1;
    ++header.lines;
    if (header.lines == 1) {
      if (words.size() != 1 || words[0] != "ply") return bad(name, place, "not a PLY file");
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
        return bad(name, place, fmt::format("unknown format \"{}\"", words[1]));
      }
    } else if (words[0] == "element" && words.size() == 3) {
      Element element{std::string(words[1]), 0, {}};
      if (!parse_number(words[2], element.count)) {
        return bad(name, place, fmt::format("\"{}\" is not a count", words[2]));
      }
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && !header.elements.empty()) {
      const auto property = parse_property(words);
      if (!property) return bad(name, place, "a property needs a known type and a name");
      header.elements.back().properties.push_back(*property);
    } else {
      return bad(name, place, fmt::format("unexpected \"{}\" in the header", words[0]));
    }
  }
  if (!format_seen) return bad(name, "line 2", "the format line is missing");
  return header;
}

// --------------------------------------------------------------------------------------- body --

/// Reads one scalar after the other, whatever the encoding, and knows where it is.
class Body {
 public:
  Body(std::string_view bytes, const Header& header)
      : bytes_(bytes),
        position_(header.size),
        line_(header.lines + 1),
        encoding_(header.encoding) {}

  /// Nothing at the end of the data or where no number stands.
  std::optional<double> next(Scalar type) {
    return encoding_ == Encoding::ascii ? next_word(type) : next_binary(type);
  }

  std::string place() const {
    return encoding_ == Encoding::ascii ? fmt::format("line {}", line_)
                                        : fmt::format("byte {}", position_);
  }

  std::size_t remaining() const { return bytes_.size() - position_; }

  /// True if nothing but white space (ascii) follows.
  bool at_end() {
    if (encoding_ == Encoding::ascii) skip_space();
    return position_ == bytes_.size();
  }

 private:
  void skip_space() {
    while (position_ < bytes_.size() && std::strchr(" \t\r\n", bytes_[position_]) != nullptr) {
      if (bytes_[position_] == '\0') return;
      if (bytes_[position_] == '\n') ++line_;
      ++position_;
    }
  }

  std::optional<double> next_word(Scalar type) {
    skip_space();
    std::size_t end = position_;
    while (end < bytes_.size() && std::strchr(" \t\r\n", bytes_[end]) == nullptr) ++end;
    const std::string_view word = bytes_.substr(position_, end - position_);
    double value = 0.0;
    if (!parse_number(word, value)) return std::nullopt;
    if (!is_float(type) && value != std::floor(value)) return std::nullopt;
    position_ = end;
    return value;
  }

  template <class T>
  double load() const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + position_, sizeof(T));
    const bool file_is_little = encoding_ == Encoding::little_endian;
    if (file_is_little != (std::endian::native == std::endian::little)) {
      std::reverse(raw.begin(), raw.end());
    }
    return static_cast<double>(std::bit_cast<T>(raw));
  }

  std::optional<double> next_binary(Scalar type) {
    const std::size_t size = size_of(type);
    if (remaining() < size) return std::nullopt;
    double value = 0.0;
    switch (type) {
      case Scalar::int8: value = load<std::int8_t>(); break;
      case Scalar::uint8: value = load<std::uint8_t>(); break;
      case Scalar::int16: value = load<std::int16_t>(); break;
      case Scalar::uint16: value = load<std::uint16_t>(); break;
      case Scalar::int32: value = load<std::int32_t>(); break;
      case Scalar::uint32: value = load<std::uint32_t>(); break;
      case Scalar::float32: value = load<float>(); break;
      case Scalar::float64: value = load<double>(); break;
    }
    position_ += size;
    return value;
  }

  std::string_view bytes_;
  std::size_t position_;
  int line_;
  Encoding encoding_;
};

/// Least bytes that `count` records of this element can take.
double smallest_size(const Element& element, Encoding encoding) {
  double record = 0.0;
  for (const Property& property : element.properties) {
    record += encoding == Encoding::ascii
                  ? 2.0
                  : static_cast<double>(size_of(property.list_count.value_or(property.type)));
  }
  return record * static_cast<double>(element.count);
}

class MeshReader {
 public:
  MeshReader(std::string_view bytes, std::string_view name, const Header& header)
      : name_(name), header_(header), body_(bytes, header) {}

  Result<TriangleMesh> read() {
    bool vertices_seen = false;
    for (const Element& element : header_.elements) {
      if (element.properties.empty() && element.count > 0) {
        return bad(name_, body_.place(),
                   fmt::format("element \"{}\" has no properties", element.name));
      }
      // One byte of slack: the last ascii word needs no separator.
      if (smallest_size(element, header_.encoding) > static_cast<double>(body_.remaining()) + 1.0 ||
          element.count > static_cast<std::uint64_t>(INT32_MAX)) {
        return bad(name_, body_.place(),
                   fmt::format("the header claims {} \"{}\" records, the file is too short for "
                               "them",
                               element.count, element.name));
      }
      Result<void> done;
      if (element.name == "vertex") {
        vertices_seen = true;
        done = read_vertices(element);
      } else if (element.name == "face") {
        if (!vertices_seen) return bad(name_, body_.place(), "faces come before the vertices");
        done = read_faces(element);
      } else {
        done = skip(element);
      }
      if (!done) return forward(done);
    }
    if (!vertices_seen) return bad(name_, "header", "there is no \"vertex\" element");
    if (!body_.at_end()) {
      return bad(name_, body_.place(), "there is more data than the header announces");
    }
    mesh_.triangles.resize(static_cast<Eigen::Index>(corners_.size() / 3), 3);
    std::copy(corners_.begin(), corners_.end(), mesh_.triangles.data());
    return std::move(mesh_);
  }

 private:
  tl::unexpected<Error> truncated() const {
    return bad(name_, body_.place(), "a number was expected here");
  }

  /// Reads one record; scalar properties land in `values`, by index.
  Result<void> read_record(const Element& element, std::vector<double>& values) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      const auto value = body_.next(property.list_count.value_or(property.type));
      if (!value) return truncated();
      values[i] = *value;
      if (!property.list_count) continue;
      if (*value < 0.0) return bad(name_, body_.place(), "a list has a negative length");
      list_.clear();
      for (double k = 0; k < *value; ++k) {
        const auto item = body_.next(property.type);
        if (!item) return truncated();
        list_.push_back(*item);
      }
      if (static_cast<int>(i) == list_property_) kept_list_ = list_;
    }
    return {};
  }

  Result<void> skip(const Element& element) {
    std::vector<double> values(element.properties.size());
    list_property_ = -1;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (const auto read = read_record(element, values); !read) return read;
    }
    return {};
  }

  Result<void> read_vertices(const Element& element) {
    const std::array<int, 3> position{element.find("x"), element.find("y"), element.find("z")};
    const std::array<int, 3> normal{element.find("nx"), element.find("ny"), element.find("nz")};
    const std::array<int, 3> color{element.find("red"), element.find("green"),
                                   element.find("blue")};
    for (int axis = 0; axis < 3; ++axis) {
      if (position[axis] < 0 || element.properties[position[axis]].list_count) {
        return bad(name_, "header", "the vertices have no x, y, z");
      }
    }
    const auto has = [&](const std::array<int, 3>& columns) {
      return columns[0] >= 0 && columns[1] >= 0 && columns[2] >= 0;
    };
    const bool has_color = has(color) && element.properties[color[0]].type == Scalar::uint8 &&
                           element.properties[color[1]].type == Scalar::uint8 &&
                           element.properties[color[2]].type == Scalar::uint8;
    const auto rows = static_cast<Eigen::Index>(element.count);
    mesh_.vertices.resize(rows, 3);
    if (has(normal)) mesh_.normals.resize(rows, 3);
    if (has_color) mesh_.colors.resize(rows, 3);
    std::vector<double> values(element.properties.size());
    list_property_ = -1;
    for (Eigen::Index row = 0; row < rows; ++row) {
      if (const auto read = read_record(element, values); !read) return read;
      for (int axis = 0; axis < 3; ++axis) {
        const double coordinate = values[position[axis]];
        if (!std::isfinite(coordinate)) {
          return bad(name_, body_.place(), fmt::format("vertex {} is not finite", row));
        }
        mesh_.vertices(row, axis) = coordinate;
        if (has(normal)) {
          if (!std::isfinite(values[normal[axis]])) {
            return bad(name_, body_.place(),
                       fmt::format("the normal of vertex {} is not finite", row));
          }
          mesh_.normals(row, axis) = values[normal[axis]];
        }
        if (has_color) {
          const double level = values[color[axis]];
          if (level < 0.0 || level > 255.0) {
            return bad(name_, body_.place(), fmt::format("colour {} is not within 0..255", level));
          }
          mesh_.colors(row, axis) = static_cast<std::uint8_t>(level);
        }
      }
    }
    return {};
  }

  Result<void> read_faces(const Element& element) {
    list_property_ = element.find("vertex_indices");
    if (list_property_ < 0) list_property_ = element.find("vertex_index");
    if (list_property_ < 0 || !element.properties[list_property_].list_count ||
        is_float(element.properties[list_property_].type)) {
      return bad(name_, "header", "the faces have no integer list \"vertex_indices\"");
    }
    std::vector<double> values(element.properties.size());
    for (std::uint64_t face = 0; face < element.count; ++face) {
      if (const auto read = read_record(element, values); !read) return read;
      if (kept_list_.size() < 3) {
        return bad(name_, body_.place(),
                   fmt::format("face {} has {} corners", face, kept_list_.size()));
      }
      for (const double index : kept_list_) {
        if (index < 0.0 || index >= static_cast<double>(mesh_.vertices.rows())) {
          return bad(
              name_, body_.place(),
              fmt::format("face {} names vertex {:.0f} of {}", face, index, mesh_.vertices.rows()));
        }
      }
      for (std::size_t k = 2; k < kept_list_.size(); ++k) {
        corners_.push_back(static_cast<int>(kept_list_[0]));
        corners_.push_back(static_cast<int>(kept_list_[k - 1]));
        corners_.push_back(static_cast<int>(kept_list_[k]));
      }
    }
    return {};
  }

  std::string_view name_;
  const Header& header_;
  Body body_;
  TriangleMesh mesh_;
  std::vector<int> corners_;
  std::vector<double> list_;
  std::vector<double> kept_list_;
  int list_property_ = -1;
};

template <class T>
void append(std::string& bytes, T value) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

}  // namespace

Result<TriangleMesh> parse_ply(std::string_view bytes, std::string_view name) {
  const auto header = parse_header(bytes, name);
  if (!header) return forward(header);
  return MeshReader(bytes, name, *header).read();
}

Result<TriangleMesh> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return forward(bytes);
  return parse_ply(*bytes, path.string());
}

Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& path) {
  const bool has_normals = mesh.normals.rows() == mesh.vertices.rows() && mesh.normals.rows() > 0;
  const bool has_colors = mesh.colors.rows() == mesh.vertices.rows() && mesh.colors.rows() > 0;
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n{}{}"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.rows(),
      has_normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
      has_colors ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "",
      mesh.triangles.rows());
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(mesh.vertices(v, axis)));
    if (has_normals) {
      for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(mesh.normals(v, axis)));
    }
    if (has_colors) {
      for (int axis = 0; axis < 3; ++axis) append(bytes, mesh.colors(v, axis));
    }
  }
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    append(bytes, std::uint8_t{3});
    for (int corner = 0; corner < 3; ++corner) append(bytes, mesh.triangles(f, corner));
  }
  return write_file_durably(path, bytes);
}

}  // namespace skullstation
