#pragma once

#include <span>
#include <vector>

#include "reconstruction/phantom/skull_landmarks.h"
#include "reconstruction/phantom/warp_conditioning.h"

namespace skullstation {

/// What the warp of a skull shall do, loosely, to the tissue that it carries along: keep the
/// thickness between the landmark pairs of thickness_table() and the length of the ears, and bring
/// tip and wings of the nose and the mouth to where the bone foretells them. Indices count the
/// bone's landmarks first, then the skin's.
std::vector<WarpTarget> tissue_targets(std::span<const Landmark> bone,
                                       std::span<const Landmark> skin);

}  // namespace skullstation
