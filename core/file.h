#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/result.h"

namespace skullstation {

/// The whole file. Fails with the path and the system's reason.
Result<std::string> read_file(const std::filesystem::path& path);

/// Writes the file so that after a power cut it is either there whole or not at all: a temporary
/// name in the same folder, fsync, rename, fsync of the folder.
Result<void> write_file_durably(const std::filesystem::path& path, std::string_view bytes);

/// Makes the folder and its parents; fails if it can't be written to.
Result<void> make_writable_folder(const std::filesystem::path& folder);

/// Free space [bytes] for this user on the volume of `folder`.
Result<std::uint64_t> free_space_bytes(const std::filesystem::path& folder);

/// Makes what was done in the folder (files made, renamed, removed) outlast a power cut.
Result<void> sync_folder(const std::filesystem::path& folder);

/// Lower-case hexadecimal SHA-256 of the bytes (64 characters).
std::string sha256_hex(std::string_view bytes);

/// The same of a file's content, however large.
Result<std::string> sha256_of_file(const std::filesystem::path& path);

}  // namespace skullstation
