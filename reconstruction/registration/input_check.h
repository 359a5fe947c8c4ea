#pragma once

#include <string>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Whether a mesh can be a skull or head at all: numbers, enough vertices, area, a size of 60 to
/// 600 mm (unless the unit is unknown), normals that point outwards: not inside out, as mirrored
/// meshes are. Fails with `bad_input`, in words; `what` is "skull" or "head".
Result<void> check_input(const TriangleMesh& mesh, const std::string& what, bool unit_unknown);

/// Whether the triangles are seen from outside clockwise: those at the mesh's extremes in many
/// directions face inwards.
bool is_inside_out(const TriangleMesh& mesh);

}  // namespace skullstation
