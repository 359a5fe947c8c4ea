#pragma once

#include <filesystem>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Reads a PLY, OBJ or STL mesh [mm], told apart by the file's extension in either case.
Result<TriangleMesh> read_mesh(const std::filesystem::path& path);

/// Writes PLY (binary), OBJ, STL (binary) or GLB, told by the extension. Whole or not at all.
Result<void> write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace skullstation
