#include "daemon/case/known_depths.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string>
#include <utility>

#include "core/file.h"
#include "core/nearest_word.h"

namespace skullstation {

namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blank = " \t\r\"";
  const std::size_t first = text.find_first_not_of(blank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

std::optional<double> number_of(std::string_view cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) return std::nullopt;
  return value;
}

}  // namespace

Result<std::vector<KnownDepth>> parse_known_depths(std::string_view text, std::string_view name,
                                                   const SkullTemplate& skull) {
  std::vector<KnownDepth> depths;
  for (int line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string_view> cells = cells_of(line);
    if (line_number == 1 && cells.size() > 1 && !number_of(cells[1])) continue;  // the heading
    const auto bad = [&](std::string what, std::string advice = {}) {
      return fail(ErrorKind::bad_input, fmt::format("{}:{}", name, line_number), std::move(what),
                  std::move(advice));
    };
    if (cells.size() < 2 || cells.size() > 3) {
      return bad("is not \"landmark,depth_mm\" or \"landmark,depth_mm,sd_mm\"");
    }
    KnownDepth known;
    const auto depth = number_of(cells[1]);
    const auto sd = cells.size() == 3 ? number_of(cells[2]) : known.sd_mm;
    if (!depth || !sd) return bad("holds something that is no number");
    known.depth_mm = *depth;
    known.sd_mm = *sd;
    const std::size_t found = depths.size();
    std::vector<std::string> names;
    for (const TemplateLandmark& landmark : skull.landmarks) {
      names.push_back(landmark.name);
      const std::string wanted(cells[0]);
      if (landmark.name != wanted && landmark.name != wanted + " left" &&
          landmark.name != wanted + " right") {
        continue;
      }
      known.bone = landmark.place;
      depths.push_back(known);
    }
    if (found == depths.size()) {
      const std::string near = nearest_word(cells[0], names);
      return bad(fmt::format("the skull has no landmark \"{}\"", cells[0]),
                 near.empty() ? std::string() : fmt::format("did you mean \"{}\"?", near));
    }
  }
  if (depths.empty()) {
    return fail(ErrorKind::bad_input, std::string(name), "holds no depth");
  }
  return depths;
}

Result<std::vector<KnownDepth>> read_known_depths(const std::filesystem::path& file,
                                                  const SkullTemplate& skull) {
  const auto text = read_file(file);
  if (!text) return forward(text);
  return parse_known_depths(*text, file.string(), skull);
}

}  // namespace skullstation
