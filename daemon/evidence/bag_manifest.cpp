#include "daemon/evidence/bag_manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace skullstation {

namespace {

bool is_utf8(std::string_view text) {
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

}  // namespace

bool is_sha256(std::string_view text) {
  return text.size() == 64 && std::ranges::all_of(text, [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

std::optional<std::string> unfit_bag_path(std::string_view path) {
  if (path.empty() || path.front() == '/' || path.front() == '~') return "is no path in the bag";
  if (std::ranges::any_of(path, [](char c) { return (c >= 0 && c < 32) || c == 127; })) {
    return "holds a control character";
  }
  if (!is_utf8(path)) return "is not UTF-8";
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    const std::string_view part = path.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return "is no path in the bag";
    begin = end + 1;
  }
  return std::nullopt;
}

std::string escaped_bag_path(std::string_view path) {
  std::string escaped;
  for (const char c : path) escaped += c == '%' ? std::string("%25") : std::string(1, c);
  return escaped;
}

std::optional<std::string> unescaped_bag_path(std::string_view text) {
  std::string path;
  for (std::size_t i = 0; i < text.size(); ++i) {
    path += text[i];
    if (text[i] != '%') continue;
    if (text.substr(i, 3) != "%25") return std::nullopt;
    i += 2;
  }
  return path;
}

std::optional<std::string_view> take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return line;
}

std::string format_manifest(const std::vector<ManifestLine>& lines) {
  std::string text;
  for (const ManifestLine& line : lines) {
    text += fmt::format("{}  {}\n", line.sha256, escaped_bag_path(line.path));
  }
  return text;
}

Result<std::vector<ManifestLine>> parse_manifest(std::string_view text, std::string_view name) {
  std::vector<ManifestLine> lines;
  const auto wrong = [&](const std::string& what) {
    return fail(ErrorKind::bad_input, fmt::format("{}: line {}", name, lines.size() + 1), what);
  };
  while (!text.empty()) {
    const auto line = take_line(text);
    if (!line) return wrong("does not end with a line feed");
    if (!is_sha256(line->substr(0, 64)) || line->substr(64, 2) != "  ") {
      return wrong("is not a SHA-256 sum (64 lower-case hexadecimal digits), two spaces, a path");
    }
    const auto path = unescaped_bag_path(line->substr(66));
    if (!path) return wrong("holds a '%' that is not \"%25\"");
    if (const auto why = unfit_bag_path(*path)) return wrong("names a file whose path " + *why);
    if (!lines.empty() && *path <= lines.back().path) {
      return wrong("is out of order or named twice");
    }
    lines.push_back({*path, std::string(line->substr(0, 64))});
  }
  return lines;
}

}  // namespace skullstation
