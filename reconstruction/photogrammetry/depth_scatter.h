#pragma once

#include <span>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/depth_maps.h"

namespace skullstation {

/// The standard error of each vertex along its normal [mm], by how far the views' own depths lie
/// from the surface that was made of all of them: those within `reach_mm`, in views that face it
/// (less than 80 deg off the normal); 0 where fewer than 2 views have one. It is twice the standard
/// deviation of one view's depth: neighbouring views are matched with one another and err alike, so
/// that their number makes nothing better and their scatter shows half of the error only (measured:
/// docs/photogrammetry.md).
/// \pre the mesh has normals
std::vector<float> depth_scatter(const TriangleMesh& mesh, std::span<const DepthMap> maps,
                                 double reach_mm, int threads);

}  // namespace skullstation
