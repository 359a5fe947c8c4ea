#include "core/nearest_word.h"

#include <algorithm>
#include <numeric>

namespace skullstation {

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest_word(std::string_view mistyped, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = mistyped.size() / 3 + 2;
  for (const std::string& word : known) {
    // "backlash" for "backlash_deg": a forgotten unit is one mistake, however long it is.
    const bool cut_short = mistyped.size() >= 3 && word.starts_with(mistyped);
    const std::size_t distance = cut_short ? 1 : edit_distance(mistyped, word);
    if (distance < best_distance) {
      best = word;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace skullstation
