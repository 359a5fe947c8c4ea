#include "reconstruction/io/obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <vector>

#include "core/file.h"
#include "reconstruction/io/text_lines.h"

namespace skullstation {

namespace {

/// Statements that carry no geometry of a triangle mesh.
constexpr std::array<std::string_view, 11> left_out = {"vt", "vp", "g",      "o",      "s", "mg",
                                                       "l",  "p",  "mtllib", "usemtl", "#"};

class ObjReader {
 public:
  ObjReader(std::string_view text, std::string_view name) : lines_(text), name_(name) {}

  Result<TriangleMesh> read() {
    std::string_view line;
    while (lines_.next(line)) {
      words_ = words_of(line);
      if (words_.empty()) continue;
      if (words_.back().ends_with('\\')) {
        return bad("continued lines (\\) are not supported");
      }
      Result<void> read;
      if (words_[0] == "v") {
        read = read_vertex();
      } else if (words_[0] == "vn") {
        read = read_normal();
      } else if (words_[0] == "f") {
        read = read_face();
      } else if (words_[0][0] != '#' && std::ranges::find(left_out, words_[0]) == left_out.end()) {
        read = bad(fmt::format("\"{}\" is not a statement of an OBJ mesh", words_[0]));
      }
      if (!read) return forward(read);
    }
    if (positions_.empty()) return bad_file(name_, "line 1", "there are no vertices (\"v x y z\")");
    return build();
  }

 private:
  tl::unexpected<Error> bad(std::string what) const {
    return bad_file(name_, fmt::format("line {}", lines_.number()), std::move(what));
  }

  /// The numbers behind the keyword.
  Result<std::vector<double>> numbers() const {
    std::vector<double> values(words_.size() - 1);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!parse_number(words_[i + 1], values[i])) {
        return bad(fmt::format("\"{}\" is not a number", words_[i + 1]));
      }
      if (!std::isfinite(values[i])) return bad("a coordinate is not finite");
    }
    return values;
  }

  /// x y z, x y z w (w is for curves alone) or x y z r g b.
  Result<void> read_vertex() {
    const auto values = numbers();
    if (!values) return forward(values);
    if (values->size() != 3 && values->size() != 4 && values->size() != 6) {
      return bad("a vertex has 3 coordinates, and 3 colour levels or none");
    }
    positions_.insert(positions_.end(), values->begin(), values->begin() + 3);
    if (values->size() == 6) {
      for (std::size_t i = 3; i < 6; ++i) {
        const double level = (*values)[i];
        if (level < 0.0 || level > 1.0) {
          return bad(fmt::format("colour {} is not within 0..1", level));
        }
        colors_.push_back(static_cast<std::uint8_t>(std::lround(255.0 * level)));
      }
    }
    return {};
  }

  Result<void> read_normal() {
    const auto values = numbers();
    if (!values) return forward(values);
    if (values->size() != 3) return bad("a normal has 3 coordinates");
    normals_.insert(normals_.end(), values->begin(), values->end());
    return {};
  }

  /// Index from 0 of the `word`th of `count` things; OBJ counts from 1, or backwards from -1.
  std::optional<int> index_of(std::string_view word, std::size_t count) const {
    std::int64_t index = 0;
    if (!parse_number(word, index)) return std::nullopt;
    index = index < 0 ? static_cast<std::int64_t>(count) + index : index - 1;
    if (index < 0 || index >= static_cast<std::int64_t>(count)) return std::nullopt;
    return static_cast<int>(index);
  }

  /// v, v/vt, v//vn or v/vt/vn.
  Result<void> read_face() {
    if (words_.size() < 4) return bad(fmt::format("a face has {} corners", words_.size() - 1));
    std::vector<int> polygon;
    for (std::size_t i = 1; i < words_.size(); ++i) {
      const std::string_view corner = words_[i];
      const std::size_t first_slash = corner.find('/');
      const auto vertex = index_of(corner.substr(0, first_slash), positions_.size() / 3);
      if (!vertex) {
        return bad(fmt::format("\"{}\" names none of the {} vertices so far", corner,
                               positions_.size() / 3));
      }
      polygon.push_back(*vertex);
      if (first_slash == std::string_view::npos) continue;
      const std::size_t second_slash = corner.find('/', first_slash + 1);
      if (second_slash == std::string_view::npos) continue;
      const auto normal = index_of(corner.substr(second_slash + 1), normals_.size() / 3);
      if (!normal) {
        return bad(
            fmt::format("\"{}\" names none of the {} normals so far", corner, normals_.size() / 3));
      }
      note_normal(*vertex, *normal);
    }
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      corners_.insert(corners_.end(), {polygon[0], polygon[k - 1], polygon[k]});
    }
    return {};
  }

  void note_normal(int vertex, int normal) {
    const auto place = static_cast<std::size_t>(vertex);
    if (normal_of_vertex_.size() <= place) normal_of_vertex_.resize(place + 1, -1);
    if (normal_of_vertex_[place] >= 0 && normal_of_vertex_[place] != normal) {
      one_normal_each_ = false;
    }
    normal_of_vertex_[place] = normal;
  }

  TriangleMesh build() {
    TriangleMesh mesh;
    const auto count = static_cast<Eigen::Index>(positions_.size() / 3);
    mesh.vertices = Eigen::Map<const Points3>(positions_.data(), count, 3);
    if (colors_.size() == positions_.size()) {
      mesh.colors = Eigen::Map<const Colors>(colors_.data(), count, 3);
    }
    if (one_normal_each_ && std::ssize(normal_of_vertex_) == count &&
        std::ranges::find(normal_of_vertex_, -1) == normal_of_vertex_.end()) {
      mesh.normals.resize(count, 3);
      for (Eigen::Index v = 0; v < count; ++v) {
        const auto from =
            3 * static_cast<std::size_t>(normal_of_vertex_[static_cast<std::size_t>(v)]);
        mesh.normals.row(v) << normals_[from], normals_[from + 1], normals_[from + 2];
      }
    }
    mesh.triangles = Eigen::Map<const Triangles>(corners_.data(),
                                                 static_cast<Eigen::Index>(corners_.size() / 3), 3);
    return mesh;
  }

  TextLines lines_;
  std::string_view name_;
  std::vector<std::string_view> words_;
  std::vector<double> positions_;
  std::vector<double> normals_;
  std::vector<std::uint8_t> colors_;
  std::vector<int> corners_;
  std::vector<int> normal_of_vertex_;
  bool one_normal_each_ = true;
};

}  // namespace

Result<TriangleMesh> parse_obj(std::string_view text, std::string_view name) {
  return ObjReader(text, name).read();
}

Result<TriangleMesh> read_obj(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return forward(text);
  return parse_obj(*text, path.string());
}

Result<void> write_obj(const TriangleMesh& mesh, const std::filesystem::path& path) {
  const bool has_normals = mesh.normals.rows() == mesh.vertices.rows();
  const bool has_colors = mesh.colors.rows() == mesh.vertices.rows();
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "# skullstation, units mm\n");
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3f point = mesh.vertices.row(v).cast<float>();
    fmt::format_to(out, "v {} {} {}", point.x(), point.y(), point.z());
    if (has_colors) {
      for (const std::uint8_t level : mesh.colors.row(v)) {
        fmt::format_to(out, " {:.4f}", level / 255.0);
      }
    }
    fmt::format_to(out, "\n");
  }
  if (has_normals) {
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      const Eigen::RowVector3f normal = mesh.normals.row(v).cast<float>();
      fmt::format_to(out, "vn {} {} {}\n", normal.x(), normal.y(), normal.z());
    }
  }
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::RowVector3i corners = mesh.triangles.row(f).array() + 1;
    if (has_normals) {
      fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2}\n", corners.x(), corners.y(), corners.z());
    } else {
      fmt::format_to(out, "f {} {} {}\n", corners.x(), corners.y(), corners.z());
    }
  }
  return write_file_durably(path, std::string_view(text.data(), text.size()));
}

}  // namespace skullstation
