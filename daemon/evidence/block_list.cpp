#include "daemon/evidence/block_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "daemon/evidence/bag_manifest.h"

namespace skullstation {

namespace {

std::uint64_t blocks_of(std::uint64_t bytes) {
  return bytes / block_bytes + (bytes % block_bytes != 0 ? 1 : 0);
}

/// A decimal number as format() writes it: no sign, no leading zero.
std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (fmt::format("{}", value) != text) return std::nullopt;
  return value;
}

void append(std::vector<ByteRange>& ranges, ByteRange range) {
  if (range.begin >= range.end) return;
  if (!ranges.empty() && ranges.back().end >= range.begin) {
    ranges.back().end = std::max(ranges.back().end, range.end);
  } else {
    ranges.push_back(range);
  }
}

}  // namespace

std::string format_block_list(const std::map<std::string, FileDigest>& files) {
  std::string text;
  for (const auto& [path, file] : files) {
    text += fmt::format("path {}\nbytes {}\n", escaped_bag_path(path), file.bytes);
    for (const std::string& sum : file.block_sha256) text += sum + "\n";
  }
  return text;
}

Result<std::map<std::string, FileDigest>> parse_block_list(std::string_view text,
                                                           std::string_view name) {
  std::map<std::string, FileDigest> files;
  std::size_t number = 0;
  std::string_view rest = text;
  const auto next = [&] {
    ++number;
    return take_line(rest).value_or("");
  };
  const auto wrong = [&](const std::string& what) {
    return fail(ErrorKind::bad_input, fmt::format("{}: line {}", name, number), what);
  };
  while (!rest.empty()) {
    const std::string_view path_line = next();
    if (!path_line.starts_with("path ")) return wrong("is not \"path\" with a file's path");
    const auto path = unescaped_bag_path(path_line.substr(5));
    if (!path) return wrong("holds a '%' that is not \"%25\"");
    if (const auto why = unfit_bag_path(*path)) return wrong("names a file whose path " + *why);
    if (!files.empty() && *path <= files.rbegin()->first) {
      return wrong("is out of order or named twice");
    }
    const std::string_view bytes_line = next();
    const auto bytes =
        bytes_line.starts_with("bytes ") ? whole_number(bytes_line.substr(6)) : std::nullopt;
    if (!bytes) return wrong("is not \"bytes\" with a file's size");
    FileDigest& file = files[*path];
    file.bytes = *bytes;
    const std::uint64_t blocks = blocks_of(*bytes);
    if (blocks > rest.size() / 65) return wrong("claims more blocks than there are sums");
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const std::string_view sum = next();
      if (!is_sha256(sum)) return wrong("is not a block's SHA-256 sum");
      file.block_sha256.emplace_back(sum);
    }
  }
  return files;
}

std::vector<ByteRange> changed_ranges(const FileDigest& recorded, const FileDigest& found) {
  std::vector<ByteRange> ranges;
  const std::uint64_t both = std::min(recorded.bytes, found.bytes);
  const std::uint64_t longest = std::max(recorded.bytes, found.bytes);
  // A block that ends early in one of the files can only be compared as far as the other has it.
  const std::uint64_t whole_blocks =
      recorded.bytes == found.bytes ? recorded.block_sha256.size() : both / block_bytes;
  for (std::uint64_t i = 0; i < whole_blocks; ++i) {
    if (recorded.block_sha256[i] != found.block_sha256[i]) {
      append(ranges, {i * block_bytes, std::min((i + 1) * block_bytes, longest)});
    }
  }
  if (recorded.bytes != found.bytes) append(ranges, {whole_blocks * block_bytes, longest});
  return ranges;
}

}  // namespace skullstation
