#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/result.h"

namespace skullstation {

/// A binary glTF 2.0 file, taken apart: its JSON, and the chunks after it as they are.
// NOLINTNEXTLINE(bugprone-exception-escape): moving a JSON value throws nothing in fact
struct GlbContainer {
  nlohmann::json gltf;
  std::string chunks;
};

/// The error of a file that is none; `where` names it.
tl::unexpected<Error> no_glb(const std::string& where, const std::string& why);

/// Errors (bad_input): not a GLB file, or cut off; `where` names it.
Result<GlbContainer> split_glb(std::string_view bytes, const std::string& where);
std::string join_glb(const GlbContainer& container);

/// What a viewer must know of the mesh in such a file.
struct GlbExtent {
  std::int64_t triangles = 0;
  nlohmann::json min, max;  ///< of the positions [m], as the file gives them
};
Result<GlbExtent> glb_extent(const nlohmann::json& gltf, const std::string& where);

}  // namespace skullstation
