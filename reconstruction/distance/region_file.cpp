#include "reconstruction/distance/region_file.h"

#include <fmt/format.h>

#include "core/file.h"
#include "reconstruction/io/text_lines.h"

namespace skullstation {

Result<std::vector<bool>> read_region(const std::filesystem::path& path, int vertex_count) {
  const auto text = read_file(path);
  if (!text) return forward(text);
  std::vector<bool> region(static_cast<std::size_t>(vertex_count), false);
  bool any = false;
  TextLines lines(*text);
  std::string_view line;
  while (lines.next(line)) {
    const auto words = words_of(line.substr(0, line.find('#')));
    if (words.empty()) continue;
    const std::string place = fmt::format("line {}", lines.number());
    int vertex = 0;
    if (words.size() != 1 || !parse_number(words[0], vertex)) {
      return bad_file(path.string(), place, "one vertex number was expected");
    }
    if (vertex < 0 || vertex >= vertex_count) {
      return bad_file(path.string(), place,
                      fmt::format("vertex {} of {} does not exist", vertex, vertex_count));
    }
    if (region[static_cast<std::size_t>(vertex)]) {
      return bad_file(path.string(), place, fmt::format("vertex {} is named twice", vertex));
    }
    region[static_cast<std::size_t>(vertex)] = true;
    any = true;
  }
  if (!any) return bad_file(path.string(), "line 1", "the region names no vertex");
  return region;
}

}  // namespace skullstation
