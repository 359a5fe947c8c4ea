#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

/// A craniometric landmark. Bilateral ones end in " left" or " right" (the skull's own).
struct Landmark {
  std::string name;
  Eigen::Vector3d position_mm;
  bool on_mandible = false;
};

/// The landmarks of the skull of the given shape, on its surface, in the anatomical frame [mm];
/// always the same names in the same order. Definitions after Martin & Saller 1957 and Caple &
/// Stephan 2016: extremes (vertex, zygion, ...) are found on the surface, points defined by
/// sutures (bregma, nasion, ...) lie where the canonical skull would have them.
/// \pre the shape's values lie in their ranges
std::vector<Landmark> canonical_landmarks(const SkullShape& shape = {});

}  // namespace skullstation
