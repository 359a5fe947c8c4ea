#pragma once

#include <memory>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/phantom/implicit_solid.h"
#include "reconstruction/phantom/skull_landmarks.h"

namespace skullstation {

/// The canonical adult head within its skin, in the anatomical frame [mm] of the canonical skull
/// (LPS axes, Frankfurt plane z = 0, origin midway between the porions): bald, eyes and mouth
/// closed, the neck cut off in a plane below the chin. Symmetric in x = 0.
std::unique_ptr<ImplicitSolid> skin_solid();

/// Its surface: one closed oriented manifold with normals on a grid of `edge_mm` in [0.2, 20]; lids
/// and ears want 2 mm or less. The same bytes for any number of threads (0: all).
TriangleMesh canonical_skin(double edge_mm, int threads);

/// The landmarks of the canonical skin, on its surface, in the anatomical frame [mm]; always the
/// same names in the same order. First the skin partner of every landmark pair of the T-Table
/// (Hona & Stephan 2023), named after the bone's landmark: "nasion skin", "gonion skin left"; then
/// capulometric ones (Caple & Stephan 2016): pronasale, cheilion, exocanthion, tragion, ...
std::vector<Landmark> canonical_skin_landmarks();

}  // namespace skullstation
