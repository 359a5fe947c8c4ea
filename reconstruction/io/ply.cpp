#include "reconstruction/io/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "reconstruction/io/byte_order.h"
#include "reconstruction/io/ply_header.h"
#include "reconstruction/io/text_lines.h"

namespace skullstation {

namespace {

using Encoding = PlyHeader::Encoding;
using Scalar = PlyHeader::Scalar;
using Property = PlyHeader::Property;
using Element = PlyHeader::Element;

/// Reads one scalar after the other, whatever the encoding, and knows where it is.
class Body {
 public:
  Body(std::string_view bytes, const PlyHeader& header)
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
    return static_cast<double>(load_number<T>(
        bytes_.data() + position_,
        encoding_ == Encoding::little_endian ? std::endian::little : std::endian::big));
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

class MeshReader {
 public:
  MeshReader(std::string_view bytes, std::string_view name, const PlyHeader& header)
      : name_(name), header_(header), body_(bytes, header) {}

  Result<TriangleMesh> read() {
    bool vertices_seen = false;
    for (const Element& element : header_.elements) {
      if (element.properties.empty() && element.count > 0) {
        return bad_file(name_, body_.place(),
                        fmt::format("element \"{}\" has no properties", element.name));
      }
      // One byte of slack: the last ascii word needs no separator.
      if (element.smallest_size(header_.encoding) > static_cast<double>(body_.remaining()) + 1.0 ||
          element.count > static_cast<std::uint64_t>(INT32_MAX)) {
        return bad_file(
            name_, body_.place(),
            fmt::format("the header claims {} \"{}\" records, the file is too short for "
                        "them",
                        element.count, element.name));
      }
      Result<void> done;
      if (element.name == "vertex") {
        vertices_seen = true;
        done = read_vertices(element);
      } else if (element.name == "face") {
        if (!vertices_seen) return bad_file(name_, body_.place(), "faces come before the vertices");
        done = read_faces(element);
      } else {
        done = skip(element);
      }
      if (!done) return forward(done);
    }
    if (!vertices_seen) return bad_file(name_, "header", "there is no \"vertex\" element");
    if (!body_.at_end()) {
      return bad_file(name_, body_.place(), "there is more data than the header announces");
    }
    mesh_.triangles.resize(static_cast<Eigen::Index>(corners_.size() / 3), 3);
    std::copy(corners_.begin(), corners_.end(), mesh_.triangles.data());
    return std::move(mesh_);
  }

 private:
  tl::unexpected<Error> truncated() const {
    return bad_file(name_, body_.place(), "a number was expected here");
  }

  /// Reads one record; scalar properties land in `values`, by index.
  Result<void> read_record(const Element& element, std::vector<double>& values) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      const auto value = body_.next(property.list_count.value_or(property.type));
      if (!value) return truncated();
      values[i] = *value;
      if (!property.list_count) continue;
      if (*value < 0.0) return bad_file(name_, body_.place(), "a list has a negative length");
      list_.clear();
      // What is longer than its file ends early.
      const auto length = static_cast<std::uint64_t>(std::min(*value, 1e15));
      for (std::uint64_t k = 0; k < length; ++k) {
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
      if (auto read = read_record(element, values); !read) return read;
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
        return bad_file(name_, "header", "the vertices have no x, y, z");
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
      if (auto read = read_record(element, values); !read) return read;
      for (int axis = 0; axis < 3; ++axis) {
        const double coordinate = values[position[axis]];
        if (!std::isfinite(coordinate)) {
          return bad_file(name_, body_.place(), fmt::format("vertex {} is not finite", row));
        }
        mesh_.vertices(row, axis) = coordinate;
        if (has(normal)) {
          if (!std::isfinite(values[normal[axis]])) {
            return bad_file(name_, body_.place(),
                            fmt::format("the normal of vertex {} is not finite", row));
          }
          mesh_.normals(row, axis) = values[normal[axis]];
        }
        if (has_color) {
          const double level = values[color[axis]];
          if (level < 0.0 || level > 255.0) {
            return bad_file(name_, body_.place(),
                            fmt::format("colour {} is not within 0..255", level));
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
      return bad_file(name_, "header", "the faces have no integer list \"vertex_indices\"");
    }
    std::vector<double> values(element.properties.size());
    // A triangle takes at least four bytes, whatever the header claims.
    corners_.reserve(3 * std::min<std::size_t>(element.count, body_.remaining() / 4));
    for (std::uint64_t face = 0; face < element.count; ++face) {
      if (auto read = read_record(element, values); !read) return read;
      if (kept_list_.size() < 3) {
        return bad_file(name_, body_.place(),
                        fmt::format("face {} has {} corners", face, kept_list_.size()));
      }
      for (const double index : kept_list_) {
        if (index < 0.0 || index >= static_cast<double>(mesh_.vertices.rows())) {
          return bad_file(
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
  const PlyHeader& header_;
  Body body_;
  TriangleMesh mesh_;
  std::vector<int> corners_;
  std::vector<double> list_;
  std::vector<double> kept_list_;
  int list_property_ = -1;
};

}  // namespace

Result<TriangleMesh> parse_ply(std::string_view bytes, std::string_view name) {
  const auto header = parse_ply_header(bytes, name);
  if (!header) return forward(header);
  return MeshReader(bytes, name, *header).read();
}

Result<TriangleMesh> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return forward(bytes);
  return parse_ply(*bytes, path.string());
}

Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& path,
                       const std::vector<VertexScalar>& scalars) {
  std::string scalar_properties;
  for (const VertexScalar& scalar : scalars) {
    if (scalar.values.size() != mesh.vertices.rows()) {
      return fail(ErrorKind::usage, path.string(),
                  fmt::format("\"{}\" has {} values for {} vertices", scalar.name,
                              scalar.values.size(), mesh.vertices.rows()));
    }
    scalar_properties += fmt::format("property float {}\n", scalar.name);
  }
  const bool has_normals = mesh.normals.rows() == mesh.vertices.rows() && mesh.normals.rows() > 0;
  const bool has_colors = mesh.colors.rows() == mesh.vertices.rows() && mesh.colors.rows() > 0;
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n{}{}{}"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.rows(),
      has_normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
      has_colors ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "",
      scalar_properties, mesh.triangles.rows());
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    for (int axis = 0; axis < 3; ++axis)
      append_little_endian(bytes, static_cast<float>(mesh.vertices(v, axis)));
    if (has_normals) {
      for (int axis = 0; axis < 3; ++axis)
        append_little_endian(bytes, static_cast<float>(mesh.normals(v, axis)));
    }
    if (has_colors) {
      for (int axis = 0; axis < 3; ++axis) append_little_endian(bytes, mesh.colors(v, axis));
    }
    for (const VertexScalar& scalar : scalars) {
      append_little_endian(bytes, static_cast<float>(scalar.values[v]));
    }
  }
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    append_little_endian(bytes, std::uint8_t{3});
    for (int corner = 0; corner < 3; ++corner)
      append_little_endian(bytes, mesh.triangles(f, corner));
  }
  return write_file_durably(path, bytes);
}

}  // namespace skullstation
