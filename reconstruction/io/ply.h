#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

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

/// A number for each vertex, a property of its own in the file.
struct VertexScalar {
  std::string name;  ///< a word, as PLY wants it
  Eigen::VectorXd values;
};

/// Binary little endian, float positions [mm], normals and colours where the mesh has them, then
/// the scalars as floats. Whole or not at all. Fails with `usage` for scalars of another number
/// than the vertices'.
Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& path,
                       const std::vector<VertexScalar>& scalars = {});

}  // namespace skullstation
