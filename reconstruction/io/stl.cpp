#include "reconstruction/io/stl.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <unordered_map>
#include <vector>

#include "core/file.h"
#include "core/random.h"
#include "reconstruction/io/byte_order.h"
#include "reconstruction/io/text_lines.h"

namespace skullstation {

namespace {

constexpr std::size_t header_size = 80;
constexpr std::size_t preamble_size = header_size + 4;
constexpr std::size_t record_size = 50;  // normal, three corners, attribute

using Corner = std::array<float, 3>;

struct CornerHash {
  std::size_t operator()(const Corner& corner) const {
    std::uint64_t hash = 0;
    for (const float x : corner) hash = mix(hash, std::bit_cast<std::uint32_t>(x));
    return hash;
  }
};

/// Gathers triangles; corners with the same coordinates share a vertex.
class MeshBuilder {
 public:
  void add_corner(Corner corner) {
    for (float& x : corner) x += 0.0F;  // -0 and 0 are the same place
    const auto [entry, is_new] = index_.emplace(corner, static_cast<int>(vertices_.size()));
    if (is_new) vertices_.push_back(corner);
    corners_.push_back(entry->second);
  }

  TriangleMesh build() const {
    TriangleMesh mesh;
    mesh.vertices.resize(std::ssize(vertices_), 3);
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      mesh.vertices.row(row) << vertices_[v][0], vertices_[v][1], vertices_[v][2];
    }
    mesh.triangles.resize(std::ssize(corners_) / 3, 3);
    std::copy(corners_.begin(), corners_.end(), mesh.triangles.data());
    return mesh;
  }

 private:
  std::unordered_map<Corner, int, CornerHash> index_;
  std::vector<Corner> vertices_;
  std::vector<int> corners_;
};

bool is_finite(const Corner& corner) {
  return std::isfinite(corner[0]) && std::isfinite(corner[1]) && std::isfinite(corner[2]);
}

Result<TriangleMesh> parse_binary(std::string_view bytes, std::string_view name) {
  MeshBuilder builder;
  for (std::size_t at = preamble_size; at < bytes.size(); at += record_size) {
    for (std::size_t corner = 1; corner <= 3; ++corner) {
      Corner xyz;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        xyz[axis] =
            load_number<float>(bytes.data() + at + 4 * (3 * corner + axis), std::endian::little);
      }
      if (!is_finite(xyz)) {
        return bad_file(name, fmt::format("byte {}", at + 12 * corner),
                        fmt::format("a corner of triangle {} is not finite",
                                    (at - preamble_size) / record_size));
      }
      builder.add_corner(xyz);
    }
  }
  return builder.build();
}

/// Reads "vertex x y z" and its like, one statement a line.
class AsciiReader {
 public:
  AsciiReader(std::string_view text, std::string_view name) : lines_(text), name_(name) {}

  Result<TriangleMesh> read() {
    bool solid_seen = false;
    while (next_statement()) {
      if (words_[0] != "solid") return unexpected("solid");
      solid_seen = true;
      if (const auto read = read_solid(); !read) return forward(read);
    }
    if (!solid_seen) return bad_file(name_, "line 1", "not an STL file");
    return builder_.build();
  }

 private:
  bool next_statement() {
    std::string_view line;
    while (lines_.next(line)) {
      words_ = words_of(line);
      if (!words_.empty()) return true;
    }
    words_.clear();
    return false;
  }

  tl::unexpected<Error> unexpected(std::string_view expected) const {
    const std::string place = fmt::format("line {}", lines_.number());
    if (words_.empty()) {
      return bad_file(name_, place, fmt::format("the file ends where \"{}\" is due", expected));
    }
    return bad_file(name_, place,
                    fmt::format("\"{}\" was expected, not \"{}\"", expected, words_[0]));
  }

  Result<void> expect(std::string_view first, std::string_view second) {
    next_statement();
    const std::size_t count = second.empty() ? 1 : 2;
    if (words_.size() == count && words_[0] == first && (count == 1 || words_[1] == second)) {
      return {};
    }
    return unexpected(first);
  }

  Result<void> read_solid() {
    while (next_statement()) {
      if (words_[0] == "endsolid") return {};
      if (words_.size() != 5 || words_[0] != "facet" || words_[1] != "normal") {
        return unexpected("facet normal");
      }
      if (const auto read = read_facet(); !read) return read;
    }
    return unexpected("endsolid");
  }

  Result<void> read_facet() {
    if (const auto read = expect("outer", "loop"); !read) return read;
    for (int corner = 0; corner < 3; ++corner) {
      next_statement();
      Corner xyz;
      if (words_.size() != 4 || words_[0] != "vertex") return unexpected("vertex");
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!parse_number(words_[axis + 1], xyz[axis])) {
          return bad_file(name_, fmt::format("line {}", lines_.number()),
                          fmt::format("\"{}\" is not a number", words_[axis + 1]));
        }
      }
      if (!is_finite(xyz)) {
        return bad_file(name_, fmt::format("line {}", lines_.number()), "a corner is not finite");
      }
      builder_.add_corner(xyz);
    }
    if (const auto read = expect("endloop", ""); !read) return read;
    return expect("endfacet", "");
  }

  TextLines lines_;
  std::string_view name_;
  std::vector<std::string_view> words_;
  MeshBuilder builder_;
};

Eigen::Vector3f corner_of(const TriangleMesh& mesh, Eigen::Index triangle, int corner) {
  return mesh.vertices.row(mesh.triangles(triangle, corner)).cast<float>();
}

Eigen::Vector3f normal_of(const TriangleMesh& mesh, Eigen::Index triangle) {
  const Eigen::Vector3f a = corner_of(mesh, triangle, 0);
  return (corner_of(mesh, triangle, 1) - a)
      .cross(corner_of(mesh, triangle, 2) - a)
      .stableNormalized();
}

}  // namespace

Result<TriangleMesh> parse_stl(std::string_view bytes, std::string_view name) {
  // A binary header may begin with "solid" too: the size decides.
  if (bytes.size() >= preamble_size) {
    const auto count = load_number<std::uint32_t>(bytes.data() + header_size, std::endian::little);
    const std::uint64_t size = preamble_size + std::uint64_t{record_size} * count;
    if (size == bytes.size()) return parse_binary(bytes, name);
    if (!bytes.starts_with("solid")) {
      return bad_file(name, "byte 80",
                      fmt::format("not an ascii STL file, and the {} triangles that a binary one "
                                  "claims here take {} bytes, not {}",
                                  count, size, bytes.size()));
    }
  }
  return AsciiReader(bytes, name).read();
}

Result<TriangleMesh> read_stl(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return forward(bytes);
  return parse_stl(*bytes, path.string());
}

Result<void> write_stl(const TriangleMesh& mesh, const std::filesystem::path& path) {
  std::string bytes = "skullstation, units mm";
  bytes.resize(header_size, ' ');
  append_little_endian(bytes, static_cast<std::uint32_t>(mesh.triangles.rows()));
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (const float x : normal_of(mesh, f)) append_little_endian(bytes, x);
    for (int corner = 0; corner < 3; ++corner) {
      for (const float x : corner_of(mesh, f, corner)) append_little_endian(bytes, x);
    }
    append_little_endian(bytes, std::uint16_t{0});
  }
  return write_file_durably(path, bytes);
}

Result<void> write_stl_ascii(const TriangleMesh& mesh, const std::filesystem::path& path) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "solid skullstation, units mm\n");
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::Vector3f normal = normal_of(mesh, f);
    fmt::format_to(out, "facet normal {} {} {}\nouter loop\n", normal.x(), normal.y(), normal.z());
    for (int corner = 0; corner < 3; ++corner) {
      const Eigen::Vector3f point = corner_of(mesh, f, corner);
      fmt::format_to(out, "vertex {} {} {}\n", point.x(), point.y(), point.z());
    }
    fmt::format_to(out, "endloop\nendfacet\n");
  }
  fmt::format_to(out, "endsolid skullstation\n");
  return write_file_durably(path, std::string_view(text.data(), text.size()));
}

}  // namespace skullstation
