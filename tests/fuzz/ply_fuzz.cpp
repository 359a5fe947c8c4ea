#include <cstddef>
#include <cstdint>
#include <string_view>

#include "reconstruction/io/ply.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto mesh = skullstation::parse_ply(bytes, "fuzz.ply");
  if (mesh && !mesh->vertices.allFinite()) __builtin_trap();
  if (mesh && mesh->triangles.size() > 0 &&
      (mesh->triangles.minCoeff() < 0 || mesh->triangles.maxCoeff() >= mesh->vertices.rows())) {
    __builtin_trap();
  }
  return 0;
}
