#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace skullstation {

struct ManifestLine {
  std::string path;    ///< relative to the bag, with '/'
  std::string sha256;  ///< lower-case hexadecimal

  bool operator==(const ManifestLine&) const = default;
};

/// The lines of a BagIt manifest (RFC 8493, 2.1.3), ascending by path: sum, two spaces, path with
/// '%' as "%25". What `sha256sum` writes, but for that escape.
std::string format_manifest(const std::vector<ManifestLine>& lines);

/// Reads exactly what format_manifest() writes: one form for one content, so that a changed byte
/// can't hide. `name` stands for the file; errors give the line.
Result<std::vector<ManifestLine>> parse_manifest(std::string_view text, std::string_view name);

/// Why a file of that path can't lie in a package; nothing if it can. Refused are paths that leave
/// the bag, control characters and what is no UTF-8.
std::optional<std::string> unfit_bag_path(std::string_view path);

/// Is it 64 characters of lower-case hexadecimal?
bool is_sha256(std::string_view text);

/// '%' as "%25" (RFC 8493); the other characters that it escapes can't occur.
std::string escaped_bag_path(std::string_view path);
/// The reverse; nothing for any other escape.
std::optional<std::string> unescaped_bag_path(std::string_view text);

/// The text up to its next line feed, which is taken off with it; nothing where there is none.
std::optional<std::string_view> take_line(std::string_view& text);

}  // namespace skullstation
