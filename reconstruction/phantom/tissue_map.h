#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <vector>

namespace skullstation {

/// What fills the canonical head where there is no bone.
enum class TissueKind { air, skin, fat, muscle, brain, eye };

/// "air", "skin", ...
const char* to_string(TissueKind kind);

/// Values on a regular lattice, trilinear in between, those of the border beyond it.
class ScalarLattice {
 public:
  ScalarLattice(const Eigen::AlignedBox3d& box, double spacing_mm,
                const std::function<double(const Eigen::Vector3d&)>& value, int threads);

  double at(const Eigen::Vector3d& point) const;

 private:
  Eigen::Vector3d first_;
  double inverse_spacing_ = 1.0;
  Eigen::Vector3i count_;
  std::vector<float> values_;
};

/// The soft anatomy of the canonical head, coarse but whole: airway (nasal cavity, sinuses,
/// pharynx, ear canals), brain, eyeballs, dermis, subcutaneous fat, and muscle for the rest. Mouth
/// and nostrils are closed 3 mm under the skin, so that the airway opens nowhere.
class TissueMap {
 public:
  /// Takes about a second of work on all `threads` (0: all); the same for any number of them.
  explicit TissueMap(int threads);

  /// What is at a point of the canonical head [mm, anatomical frame] that is not bone. Points
  /// outside the skin count as skin: where the skin is, its surface says better.
  TissueKind at(const Eigen::Vector3d& point) const;

 private:
  ScalarLattice skin_;    ///< distance [mm] to the skin, negative inside
  ScalarLattice brain_;   ///< to the inner surface of the skull
  ScalarLattice airway_;  ///< to the wall of the airway
};

}  // namespace skullstation
