#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Bytes of a block. A file's last one may be shorter.
constexpr std::uint64_t block_bytes = std::uint64_t{256} * 1024;

/// What a file was: enough to tell which part of it has changed.
struct FileDigest {
  std::uint64_t bytes = 0;
  std::string sha256;                     ///< of the whole file
  std::vector<std::string> block_sha256;  ///< of each block; none for an empty file

  bool operator==(const FileDigest&) const = default;
};

/// Where bytes changed: [begin, end).
struct ByteRange {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;

  bool operator==(const ByteRange&) const = default;
};

/// The text of blocks-sha256.txt: for each file a line "path", "bytes", then the sums of its blocks
/// as `split -b 256K --filter=sha256sum` prints them, but for the "  -". FileDigest::sha256 is not
/// in it (the manifest holds that).
std::string format_block_list(const std::map<std::string, FileDigest>& files);

/// Reads exactly what format_block_list() writes.
Result<std::map<std::string, FileDigest>> parse_block_list(std::string_view text,
                                                           std::string_view name);

/// The ranges in which `found` differs from `recorded`, ascending, neighbours joined. Bytes beyond
/// the end of either file are such a range.
std::vector<ByteRange> changed_ranges(const FileDigest& recorded, const FileDigest& found);

}  // namespace skullstation
