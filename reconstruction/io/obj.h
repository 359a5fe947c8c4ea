#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Reads a Wavefront OBJ mesh; lengths are taken as mm, since OBJ has no unit. Polygons are fanned
/// into triangles. Colours written behind the coordinates (v x y z r g b, 0..1) are kept if all
/// vertices have them, normals if every vertex has one of its own; texture coordinates, groups,
/// materials, lines and points are left out. Strict: NaN or infinite coordinates, indices out of
/// range, statements that OBJ meshes don't have are errors that name the line.
Result<TriangleMesh> read_obj(const std::filesystem::path& path);

/// The same from memory; `name` stands for the file in error messages.
Result<TriangleMesh> parse_obj(std::string_view text, std::string_view name);

/// Positions [mm], colours and normals where the mesh has them. Whole or not at all.
Result<void> write_obj(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace skullstation
