#pragma once

#include <cstdint>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// Teeth that a person of that age has lost, in FDI two-digit notation: on average about 3 of 28 up
/// to 64 years and 9 in older people (24.9 and 18.9 remain, NHANES 1999-2004). That loss clusters
/// in people and in molars is known, how much is our assumption.
std::vector<int> draw_missing_teeth(double age_years, std::uint64_t seed);

/// The canonical skull after the teeth were lost and their sockets healed: the vertices of the
/// crowns are moved onto the ridge that is left, so that vertices and triangles still correspond;
/// all others stay.
/// `skull` has the cranium's vertices first, the jaw closed.
TriangleMesh with_healed_sockets(TriangleMesh skull, Eigen::Index cranium_vertices,
                                 const std::vector<int>& missing_teeth, int threads);

}  // namespace skullstation
