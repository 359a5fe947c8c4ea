#pragma once

#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Points of a surface with its unit outward normals, row by row.
struct OrientedPoints {
  Points3 positions;  // #P x 3
  Points3 normals;    // #P x 3

  Eigen::Index size() const { return positions.rows(); }
};

/// Evenly spread points of the surface, about one in each cube of `spacing_mm` that the surface
/// passes; the two sides of a thin wall stay apart. Fails with `bad_input` for a mesh without area
/// and for a spacing that would take more than 100 million samples.
Result<OrientedPoints> oriented_samples(const TriangleMesh& mesh, double spacing_mm);

/// About `count` such points: the spacing follows from the surface's area.
Result<OrientedPoints> oriented_samples_of_count(const TriangleMesh& mesh, int count);

OrientedPoints transformed(const Similarity3& transform, const OrientedPoints& points);

}  // namespace skullstation
