#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace skullstation {

/// The known word that a mistyped one was most likely meant to be: smallest edit distance
/// (Levenshtein 1966), at most a third of the word's length plus one, or a word that was cut short.
/// Empty if none is close.
std::string nearest_word(std::string_view mistyped, const std::vector<std::string>& known);

}  // namespace skullstation
