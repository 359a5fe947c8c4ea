#pragma once

#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// A point that stands for a piece of a surface.
struct SurfaceSample {
  Eigen::Vector3d point;
  double area_mm2 = 0.0;
  int triangle = 0;
};

/// Covers the surface with at least `samples_per_mm2` points: each triangle is cut into k x k
/// triangles of the same area, at least one, with no side longer than three mean sample spacings;
/// their centroids are the samples, in the triangles' order. Triangles without area give none.
/// Their areas add up to the surface's. Deterministic, without random numbers. Fails with
/// `bad_input` where that would take more than 100 million samples (a mesh in other units).
Result<std::vector<SurfaceSample>> sample_surface(const TriangleMesh& mesh, double samples_per_mm2);

}  // namespace skullstation
