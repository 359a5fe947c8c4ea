#pragma once

#include <span>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/depth_maps.h"

namespace skullstation {

/// How far the views' own depths lie from the surface that was made of all of them: for each
/// vertex 1.4826 times the median distance [mm, along the normal] of those within `reach_mm`, in
/// views that face it (less than 80 deg off the normal); 0 where fewer than 2 views have one.
/// It is the standard deviation of one view's depth. The surface is not better by the root of the
/// number of views: neighbouring views are matched with one another and err alike.
/// \pre the mesh has normals
std::vector<float> depth_scatter(const TriangleMesh& mesh, std::span<const DepthMap> maps,
                                 double reach_mm, int threads);

}  // namespace skullstation
