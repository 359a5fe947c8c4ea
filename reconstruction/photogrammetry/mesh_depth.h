#pragma once

#include "core/image.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// Inverse depth [1/mm] of the triangle nearest to the camera at each pixel's centre, whichever
/// side it shows; 0 where there is none. Triangles that reach behind the camera are left out.
ImageF rendered_inverse_depth(const TriangleMesh& mesh, const Pinhole& camera,
                              const Rigid3& camera_from_table);

}  // namespace skullstation
