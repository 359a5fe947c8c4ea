#include "reconstruction/io/text_lines.h"

#include <algorithm>

namespace skullstation {

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

bool TextLines::next(std::string_view& line) {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  ++number_;
  return true;
}

tl::unexpected<Error> bad_file(std::string_view name, std::string_view place, std::string what) {
  return fail(ErrorKind::bad_input, std::string(name).append(":").append(place), std::move(what));
}

}  // namespace skullstation
