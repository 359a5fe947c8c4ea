#include "reconstruction/io/glb.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "reconstruction/io/byte_order.h"

namespace skullstation {

namespace {

using nlohmann::json;

// Numbers that the glTF 2.0 specification gives its words.
constexpr int unsigned_short = 5123;
constexpr int unsigned_int = 5125;
constexpr int float32 = 5126;
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;

/// glTF's axes from ours: x stays, z goes up to y, the face (-y) looks along +z.
Eigen::RowVector3d gltf_axes(const Eigen::RowVector3d& v) { return {v.x(), v.z(), -v.y()}; }

/// The inverse of sRGB's transfer curve (IEC 61966-2-1): glTF's vertex colours are linear.
std::uint16_t linear_level(std::uint8_t srgb) {
  const double s = srgb / 255.0;
  const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535.0 * linear));
}

/// The binary chunk and the JSON that says what lies where in it.
class GltfBuffer {
 public:
  /// Index of the accessor of a #V x 3 matrix, turned to glTF's axes and scaled.
  int add_vectors(const Points3& vectors, double scale) {
    const std::size_t begin = bytes.size();
    Eigen::RowVector3f least = Eigen::RowVector3f::Zero();
    Eigen::RowVector3f most = Eigen::RowVector3f::Zero();
    for (Eigen::Index row = 0; row < vectors.rows(); ++row) {
      const Eigen::RowVector3f v = (scale * gltf_axes(vectors.row(row))).cast<float>();
      least = row == 0 ? v : least.cwiseMin(v);
      most = row == 0 ? v : most.cwiseMax(v);
      for (const float x : v) append_little_endian(bytes, x);
    }
    json& accessor = add_accessor(begin, array_buffer, float32, "VEC3", vectors.rows());
    accessor["min"] = {least.x(), least.y(), least.z()};
    accessor["max"] = {most.x(), most.y(), most.z()};
    return last();
  }

  int add_colors(const Colors& colors) {
    const std::size_t begin = bytes.size();
    for (Eigen::Index row = 0; row < colors.rows(); ++row) {
      for (const std::uint8_t level : colors.row(row)) {
        append_little_endian(bytes, linear_level(level));
      }
      append_little_endian(bytes, std::uint16_t{65535});
    }
    add_accessor(begin, array_buffer, unsigned_short, "VEC4", colors.rows())["normalized"] = true;
    return last();
  }

  int add_coordinates(const std::vector<Eigen::Vector2f>& coordinates) {
    const std::size_t begin = bytes.size();
    for (const Eigen::Vector2f& at : coordinates) {
      append_little_endian(bytes, at.x());
      append_little_endian(bytes, at.y());
    }
    add_accessor(begin, array_buffer, float32, "VEC2",
                 static_cast<Eigen::Index>(coordinates.size()));
    return last();
  }

  /// Index of the buffer view that holds a picture's file.
  int add_image(const std::string& file) {
    views.push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", file.size()}});
    bytes += file;
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    return static_cast<int>(views.size()) - 1;
  }

  int add_triangles(const Triangles& triangles) {
    const std::size_t begin = bytes.size();
    for (Eigen::Index i = 0; i < triangles.size(); ++i) {
      append_little_endian(bytes, static_cast<std::uint32_t>(triangles.data()[i]));
    }
    add_accessor(begin, element_array_buffer, unsigned_int, "SCALAR", triangles.size());
    return last();
  }

  std::string bytes;
  json accessors = json::array();
  json views = json::array();

 private:
  json& add_accessor(std::size_t begin, int target, int type, const char* shape,
                     Eigen::Index count) {
    views.push_back({{"buffer", 0},
                     {"byteOffset", begin},
                     {"byteLength", bytes.size() - begin},
                     {"target", target}});
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", type},
                         {"count", count},
                         {"type", shape}});
    return accessors.back();
  }

  int last() const { return static_cast<int>(accessors.size()) - 1; }
};

void append_chunk(std::string& file, std::uint32_t type, std::string chunk, char padding) {
  chunk.resize((chunk.size() + 3) / 4 * 4, padding);
  append_little_endian(file, static_cast<std::uint32_t>(chunk.size()));
  append_little_endian(file, type);
  file += chunk;
}

json plain_material() {
  return {{"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 0.8}}}};
}

/// A file of one mesh; `rest` are further members of the glTF object.
Result<void> write_file(GltfBuffer buffer, const json& mesh, const json& material, json rest,
                        const std::filesystem::path& path) {
  json& gltf = rest;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "skullstation"}};
  gltf["scene"] = 0;
  gltf["scenes"] = json::array({{{"nodes", {0}}}});
  gltf["nodes"] = json::array({{{"mesh", 0}, {"name", path.stem().string()}}});
  gltf["meshes"] = json::array({mesh});
  gltf["materials"] = json::array({material});
  gltf["accessors"] = buffer.accessors;
  gltf["bufferViews"] = buffer.views;
  gltf["buffers"] = json::array({{{"byteLength", buffer.bytes.size()}}});

  std::string chunks;
  append_chunk(chunks, 0x4E4F534A, gltf.dump(), ' ');               // "JSON"
  append_chunk(chunks, 0x004E4942, std::move(buffer.bytes), '\0');  // "BIN"
  std::string file = "glTF";
  append_little_endian(file, std::uint32_t{2});
  append_little_endian(file, static_cast<std::uint32_t>(12 + chunks.size()));
  return write_file_durably(path, file + chunks);
}

}  // namespace

Result<void> write_glb(const TriangleMesh& mesh, const std::filesystem::path& path,
                       const std::vector<MorphTarget>& morph_targets) {
  if (mesh.vertices.rows() == 0 || mesh.triangles.rows() == 0) {
    return fail(ErrorKind::usage, path.string(), "a GLB file can't hold a mesh without triangles");
  }
  GltfBuffer buffer;
  json attributes = {{"POSITION", buffer.add_vectors(mesh.vertices, 1e-3)}};
  if (mesh.normals.rows() == mesh.vertices.rows()) {
    attributes["NORMAL"] = buffer.add_vectors(mesh.normals, 1.0);
  }
  if (mesh.colors.rows() == mesh.vertices.rows()) {
    attributes["COLOR_0"] = buffer.add_colors(mesh.colors);
  }
  json primitive = {{"attributes", attributes},
                    {"indices", buffer.add_triangles(mesh.triangles)},
                    {"material", 0}};
  json mesh_json = {{"name", path.stem().string()}};
  for (const MorphTarget& target : morph_targets) {
    if (target.displacement_mm.rows() != mesh.vertices.rows()) {
      return fail(ErrorKind::usage, path.string(),
                  fmt::format("morph target \"{}\" moves {} vertices of {}", target.name,
                              target.displacement_mm.rows(), mesh.vertices.rows()));
    }
    primitive["targets"].push_back(
        {{"POSITION", buffer.add_vectors(target.displacement_mm, 1e-3)}});
    mesh_json["extras"]["targetNames"].push_back(target.name);
    mesh_json["weights"].push_back(0.0);
  }
  mesh_json["primitives"] = json::array({primitive});

  return write_file(std::move(buffer), mesh_json, plain_material(), json::object(), path);
}

Result<void> write_glb(const TriangleMesh& mesh, const MeshTexture& texture,
                       const std::filesystem::path& path) {
  if (mesh.vertices.rows() == 0 || mesh.triangles.rows() == 0) {
    return fail(ErrorKind::usage, path.string(), "a GLB file can't hold a mesh without triangles");
  }
  if (texture.coordinates.size() != static_cast<std::size_t>(mesh.vertices.rows())) {
    return fail(ErrorKind::usage, path.string(),
                fmt::format("{} texture coordinates for {} vertices", texture.coordinates.size(),
                            mesh.vertices.rows()));
  }
  const bool png = texture.image.starts_with("\x89PNG");
  if (!png && !texture.image.starts_with("\xff\xd8")) {
    return fail(ErrorKind::usage, path.string(), "the texture's picture is neither PNG nor JPEG");
  }
  GltfBuffer buffer;
  json attributes = {{"POSITION", buffer.add_vectors(mesh.vertices, 1e-3)},
                     {"TEXCOORD_0", buffer.add_coordinates(texture.coordinates)}};
  if (mesh.normals.rows() == mesh.vertices.rows()) {
    attributes["NORMAL"] = buffer.add_vectors(mesh.normals, 1.0);
  }
  const json primitive = {{"attributes", attributes},
                          {"indices", buffer.add_triangles(mesh.triangles)},
                          {"material", 0}};
  json material = plain_material();
  material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  // Numbers of the specification: linear filtering, with mipmaps when the picture is small; no
  // repetition.
  const json rest = {
      {"images", json::array({{{"bufferView", buffer.add_image(texture.image)},
                               {"mimeType", png ? "image/png" : "image/jpeg"}}})},
      {"samplers",
       json::array(
           {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}})},
      {"textures", json::array({{{"source", 0}, {"sampler", 0}}})}};
  return write_file(std::move(buffer),
                    {{"name", path.stem().string()}, {"primitives", json::array({primitive})}},
                    material, rest, path);
}

}  // namespace skullstation
