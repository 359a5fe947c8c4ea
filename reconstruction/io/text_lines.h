#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// A line's words, separated by blanks and tabs; a carriage return counts as a blank.
std::vector<std::string_view> words_of(std::string_view line);

/// The whole word as a number, in the C locale; a leading plus sign is allowed.
template <class Number>
bool parse_number(std::string_view word, Number& number) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc{} && end == word.data() + word.size();
}

/// Takes a text apart line by line and knows which one it is at.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : rest_(text) {}

  /// False at the end of the text.
  bool next(std::string_view& line);

  /// Number of the line that next() gave last, from 1.
  int number() const { return number_; }

 private:
  std::string_view rest_;
  int number_ = 0;
};

/// The error of a file that is not what it must be: "skull.obj:line 7: ...".
tl::unexpected<Error> bad_file(std::string_view name, std::string_view place, std::string what);

}  // namespace skullstation
