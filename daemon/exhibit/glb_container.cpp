#include "daemon/exhibit/glb_container.h"

#include "reconstruction/io/byte_order.h"

namespace skullstation {

namespace {

using nlohmann::json;

constexpr std::size_t header_bytes = 12;
constexpr std::size_t chunk_header_bytes = 8;
constexpr std::uint32_t json_chunk = 0x4E4F534A;

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  return load_number<std::uint32_t>(bytes.data() + at, std::endian::little);
}

}  // namespace

tl::unexpected<Error> no_glb(const std::string& where, const std::string& why) {
  return fail(ErrorKind::bad_input, where, "is no binary glTF 2.0 file: " + why);
}

Result<GlbContainer> split_glb(std::string_view bytes, const std::string& where) {
  if (bytes.size() < header_bytes + chunk_header_bytes || bytes.substr(0, 4) != "glTF" ||
      number_at(bytes, 4) != 2) {
    return no_glb(where, "its header is another one");
  }
  if (number_at(bytes, 8) != bytes.size()) return no_glb(where, "it has not the size that it says");
  const std::size_t length = number_at(bytes, header_bytes);
  const std::size_t begin = header_bytes + chunk_header_bytes;
  if (number_at(bytes, header_bytes + 4) != json_chunk || length > bytes.size() - begin) {
    return no_glb(where, "its JSON chunk is cut off");
  }
  json gltf = json::parse(bytes.substr(begin, length), nullptr, false);
  if (!gltf.is_object()) return no_glb(where, "its JSON can't be read");
  return GlbContainer{std::move(gltf), std::string(bytes.substr(begin + length))};
}

std::string join_glb(const GlbContainer& container) {
  std::string text = container.gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string file = "glTF";
  const std::size_t all = header_bytes + chunk_header_bytes + text.size() + container.chunks.size();
  append_little_endian(file, std::uint32_t{2});
  append_little_endian(file, static_cast<std::uint32_t>(all));
  append_little_endian(file, static_cast<std::uint32_t>(text.size()));
  append_little_endian(file, json_chunk);
  return file + text + container.chunks;
}

Result<GlbExtent> glb_extent(const json& gltf, const std::string& where) {
  try {
    const json& primitive = gltf.at("meshes").at(0).at("primitives").at(0);
    const json& positions =
        gltf.at("accessors").at(primitive.at("attributes").at("POSITION").get<std::size_t>());
    const json& indices = gltf.at("accessors").at(primitive.at("indices").get<std::size_t>());
    return GlbExtent{indices.at("count").get<std::int64_t>() / 3, positions.at("min"),
                     positions.at("max")};
  } catch (const json::exception& error) {
    return no_glb(where, error.what());
  }
}

}  // namespace skullstation
