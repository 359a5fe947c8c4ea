#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Reads a region of a mesh: a text file with one vertex number (from 0) a line; empty lines and
/// what follows a # are skipped. Gives one flag per vertex. Numbers out of range or written twice
/// are errors that name the line, and so is a file without any number.
Result<std::vector<bool>> read_region(const std::filesystem::path& path, int vertex_count);

}  // namespace skullstation
