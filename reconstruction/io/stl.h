#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Reads an STL mesh, ascii or binary; lengths are taken as mm, since STL has no unit. Corners
/// with the same coordinates become one vertex; the file's normals and attributes are not kept.
/// Strict: NaN or infinite coordinates, counts that don't fit the file's size, anything that is
/// not STL are errors that name the line (ascii) or byte (binary).
Result<TriangleMesh> read_stl(const std::filesystem::path& path);

/// The same from memory; `name` stands for the file in error messages.
Result<TriangleMesh> parse_stl(std::string_view bytes, std::string_view name);

/// Binary STL, mm. Whole or not at all.
Result<void> write_stl(const TriangleMesh& mesh, const std::filesystem::path& path);

/// Ascii STL, mm: four to five times the size of the binary, for programs that need it.
Result<void> write_stl_ascii(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace skullstation
