#include "reconstruction/templates/template_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/file.h"
#include "reconstruction/io/byte_order.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFirstLine = "skullstation-templates/1\n";

/// Writes numbers one after the other, as `Stored`.
class Writer {
 public:
  template <class Stored, class Rows>
  void table(const Rows& rows) {
    for (Eigen::Index r = 0; r < rows.rows(); ++r) {
      for (Eigen::Index c = 0; c < rows.cols(); ++c) {
        append_little_endian(bytes, static_cast<Stored>(rows(r, c)));
      }
    }
  }
  void place(const SurfacePoint& point) {
    for (int i = 0; i < 3; ++i) append_little_endian(bytes, std::int32_t{point.corners[i]});
    for (int i = 0; i < 3; ++i) append_little_endian(bytes, point.weights[i]);
  }
  std::string bytes;
};

/// Reads them back; what lies beyond the end reads as 0 and is told by `whole()`.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  template <class Stored>
  Stored number() {
    if (bytes_.size() < sizeof(Stored)) {
      bytes_ = {};
      short_ = true;
      return Stored{};
    }
    const auto value = load_number<Stored>(bytes_.data(), std::endian::little);
    bytes_.remove_prefix(sizeof(Stored));
    return value;
  }
  template <class Stored, class Rows>
  void table(Rows& rows, Eigen::Index count) {
    rows.resize(count, rows.cols());
    for (Eigen::Index r = 0; r < rows.rows(); ++r) {
      for (Eigen::Index c = 0; c < rows.cols(); ++c) rows(r, c) = number<Stored>();
    }
  }
  SurfacePoint place() {
    SurfacePoint point;
    for (int i = 0; i < 3; ++i) point.corners[i] = number<std::int32_t>();
    for (int i = 0; i < 3; ++i) point.weights[i] = number<double>();
    return point;
  }
  bool whole() const { return bytes_.empty() && !short_; }

 private:
  std::string_view bytes_;
  bool short_ = false;
};

Json names_of(const std::vector<TemplateLandmark>& landmarks) {
  Json names = Json::array();
  for (const TemplateLandmark& landmark : landmarks) names.push_back(landmark.name);
  return names;
}

}  // namespace

Result<void> write_templates(const Templates& templates, const std::filesystem::path& path) {
  const SkullTemplate& skull = templates.skull;
  const HeadTemplate& head = templates.head;
  if (const auto valid = skull.validate(); !valid) return forward(valid);
  if (const auto valid = head.validate(); !valid) return forward(valid);
  const Json header = {{"skull",
                        {{"vertices", skull.vertices.rows()},
                         {"surface_vertices", skull.boundary_count},
                         {"tetrahedra", skull.tetrahedra.rows()},
                         {"triangles", skull.boundary.rows()},
                         {"landmarks", names_of(skull.landmarks)}}},
                       {"head",
                        {{"vertices", head.vertices.rows()},
                         {"triangles", head.triangles.rows()},
                         {"landmarks", names_of(head.landmarks)}}}};
  Writer writer;
  writer.table<double>(skull.vertices);
  writer.table<std::int32_t>(skull.tetrahedra);
  writer.table<std::int32_t>(skull.boundary);
  for (const SkullRegion region : skull.region) writer.bytes += static_cast<char>(region);
  for (const bool outer : skull.outer) writer.bytes += outer ? '\1' : '\0';
  for (const SurfacePoint& point : skull.mirror) writer.place(point);
  for (const TemplateLandmark& landmark : skull.landmarks) writer.place(landmark.place);
  writer.table<double>(head.vertices);
  writer.table<std::int32_t>(head.triangles);
  for (const HeadRegion region : head.region) writer.bytes += static_cast<char>(region);
  for (const int v : head.mirror) append_little_endian(writer.bytes, std::int32_t{v});
  for (const double weight : head.data_weight) append_little_endian(writer.bytes, weight);
  for (const TemplateLandmark& landmark : head.landmarks) writer.place(landmark.place);
  return write_file_durably(path, std::string(kFirstLine) + header.dump() + "\n" + writer.bytes);
}

Result<Templates> read_templates(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return forward(bytes);
  const auto bad = [&](std::string what) {
    return fail(ErrorKind::bad_input, path.string(), std::move(what),
                "make it again: skullstation template build --out FILE");
  };
  std::string_view rest = *bytes;
  if (!rest.starts_with(kFirstLine)) {
    return bad("is no file of templates of this version (skullstation-templates/1)");
  }
  rest.remove_prefix(kFirstLine.size());
  const std::size_t end = rest.find('\n');
  const Json header = Json::parse(rest.substr(0, end), nullptr, false);
  if (end == std::string_view::npos || header.is_discarded()) return bad("its header is damaged");
  rest.remove_prefix(end + 1);

  Templates templates;
  SkullTemplate& skull = templates.skull;
  HeadTemplate& head = templates.head;
  Reader reader(rest);
  try {
    // No number of a file's header is believed beyond what its bytes can hold.
    const auto count = [&](const char* part, const char* name) {
      const auto number = header.at(part).at(name).get<std::int64_t>();
      if (number < 0 || number > static_cast<std::int64_t>(rest.size())) {
        throw std::out_of_range(name);
      }
      return static_cast<Eigen::Index>(number);
    };
    const Eigen::Index vertices = count("skull", "vertices");
    const Eigen::Index surface = count("skull", "surface_vertices");
    skull.boundary_count = static_cast<int>(surface);
    reader.table<double>(skull.vertices, vertices);
    reader.table<std::int32_t>(skull.tetrahedra, count("skull", "tetrahedra"));
    reader.table<std::int32_t>(skull.boundary, count("skull", "triangles"));
    for (Eigen::Index v = 0; v < vertices; ++v) {
      skull.region.push_back(static_cast<SkullRegion>(reader.number<std::uint8_t>()));
    }
    for (Eigen::Index v = 0; v < surface; ++v) {
      skull.outer.push_back(reader.number<std::uint8_t>() != 0);
    }
    for (Eigen::Index v = 0; v < surface; ++v) skull.mirror.push_back(reader.place());
    for (const Json& name : header.at("skull").at("landmarks")) {
      skull.landmarks.push_back({name.get<std::string>(), reader.place()});
    }
    const Eigen::Index head_vertices = count("head", "vertices");
    reader.table<double>(head.vertices, head_vertices);
    reader.table<std::int32_t>(head.triangles, count("head", "triangles"));
    for (Eigen::Index v = 0; v < head_vertices; ++v) {
      head.region.push_back(static_cast<HeadRegion>(reader.number<std::uint8_t>()));
    }
    for (Eigen::Index v = 0; v < head_vertices; ++v) {
      head.mirror.push_back(reader.number<std::int32_t>());
    }
    for (Eigen::Index v = 0; v < head_vertices; ++v) {
      head.data_weight.push_back(reader.number<double>());
    }
    for (const Json& name : header.at("head").at("landmarks")) {
      head.landmarks.push_back({name.get<std::string>(), reader.place()});
    }
  } catch (const std::exception& error) {
    return bad(fmt::format("its header is damaged ({})", error.what()));
  }
  if (!reader.whole()) return bad("it is truncated, or longer than its header says");
  if (const auto valid = skull.validate(); !valid) return bad(valid.error().message());
  if (const auto valid = head.validate(); !valid) return bad(valid.error().message());
  return templates;
}

}  // namespace skullstation
