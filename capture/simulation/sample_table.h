#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace skullstation {

/// Well-spread points of the unit square: many scramblings of the first points of the
/// two-dimensional Sobol' sequence. In each set the first 4 points lie in 4 different quarters,
/// the first 16 in 16 different sixteenths, and so on, so that sampling can go on where the first
/// few samples disagree. Pixels and dimensions pick their sets by hash.
class SampleTable {
 public:
  static constexpr int points = 64;  ///< in a set

  /// Scrambles as A. B. Owen 1995, by the hash of B. Burley 2020, "Practical Hash-based Owen
  /// Scrambling", JCGT 9(4).
  explicit SampleTable(std::uint64_t seed);

  /// \pre 0 <= index < points
  const Eigen::Vector2f& at(std::uint64_t set_hash, int index) const {
    return table_[(set_hash % sets) * points + static_cast<std::uint64_t>(index)];
  }

  /// The same point brought to the unit disc without bunching (Shirley & Chiu 1997).
  const Eigen::Vector2f& in_disc(std::uint64_t set_hash, int index) const {
    return discs_[(set_hash % sets) * points + static_cast<std::uint64_t>(index)];
  }

 private:
  static constexpr std::uint64_t sets = 256;
  std::vector<Eigen::Vector2f> table_;
  std::vector<Eigen::Vector2f> discs_;
};

}  // namespace skullstation
