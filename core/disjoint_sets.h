#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace skullstation {

/// Which of numbered things hang together: union-find with path halving (Tarjan & van Leeuwen
/// 1984). A set's root is its lowest number.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count = 0) {
    parent_.reserve(count);
    while (parent_.size() < count) add();
  }

  /// One more, a set of its own.
  void add() { parent_.push_back(static_cast<int>(parent_.size())); }

  int root(int a) {
    while (parent(a) != a) {
      parent(a) = parent(parent(a));
      a = parent(a);
    }
    return a;
  }

  void join(int a, int b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent(high) = low;
  }

 private:
  int& parent(int a) { return parent_[static_cast<std::size_t>(a)]; }

  std::vector<int> parent_;
};

}  // namespace skullstation
