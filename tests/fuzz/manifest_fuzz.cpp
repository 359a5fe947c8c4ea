#include <cstddef>
#include <cstdint>
#include <string_view>

#include "daemon/evidence/bag_manifest.h"
#include "daemon/evidence/block_list.h"

/// What is read is written as the same bytes: one form for one content.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace skullstation;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto lines = parse_manifest(text, "manifest");
  if (lines && format_manifest(*lines) != text) __builtin_trap();
  if (!lines && lines.error().what.empty()) __builtin_trap();
  const auto blocks = parse_block_list(text, "blocks");
  if (blocks && format_block_list(*blocks) != text) __builtin_trap();
  if (!blocks) return 0;
  for (const auto& [path, file] : *blocks) {
    if (!changed_ranges(file, file).empty()) __builtin_trap();
    const auto all = changed_ranges(file, FileDigest{});
    if (all.size() > 1 || (all.empty() != (file.bytes == 0))) __builtin_trap();
  }
  return 0;
}
