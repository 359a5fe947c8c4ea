#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace skullstation {

/// One write(2) to a file of sysfs, configfs or tracefs. Throws std::system_error with the path.
void write_kernel_file(const std::filesystem::path& path, std::string_view text);

/// The file's text without the last line break. Throws std::system_error with the path.
std::string read_kernel_file(const std::filesystem::path& path);

}  // namespace skullstation
