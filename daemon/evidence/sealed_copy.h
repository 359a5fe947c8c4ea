#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "core/result.h"
#include "daemon/evidence/block_list.h"

namespace skullstation {

/// Called with the number of bytes done since the last call.
using BytesDone = std::function<void(std::uint64_t bytes)>;

/// Copies a file durably (fsync) and returns what it copied, reading each byte once. Memory: a few
/// MB for a file of any size. `to` must not exist; its folder must. Symbolic links are not
/// followed. Fails with `cancelled` on request, and if the file changes while it is read.
Result<FileDigest> copy_sealed(
    const std::filesystem::path& from, const std::filesystem::path& to, int threads,
    const std::stop_token& stop, const BytesDone& done = [](std::uint64_t) {});

/// What is in a file now; block sums on request. Symbolic links are not followed.
Result<FileDigest> digest_file(
    const std::filesystem::path& path, bool with_blocks, const std::stop_token& stop,
    const BytesDone& done = [](std::uint64_t) {});

}  // namespace skullstation
