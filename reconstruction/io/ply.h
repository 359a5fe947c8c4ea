#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Reads a PLY mesh: ascii, binary little or big endian; polygons are fanned into triangles.
/// Vertex positions, normals (nx ny nz) and 8-bit colours (red green blue) are kept, anything
/// else is skipped by its declared type. Strict: NaN or infinite coordinates, indices out of
/// range, counts that the file's size can't hold, missing or trailing data are errors that name
/// the line (ascii, header) or byte (binary).
Result<TriangleMesh> read_ply(const std::filesystem::path& path);

/// The same from memory; `name` stands for the file in error messages.
Result<TriangleMesh> parse_ply(std::string_view bytes, std::string_view name);

/// Binary little endian, float positions [mm], normals and colours where the mesh has them. Whole
/// or not at all.
Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace skullstation
