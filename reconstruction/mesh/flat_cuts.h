#pragma once

#include "core/triangle_mesh.h"

namespace skullstation {

/// A closed surface of what a scanner cut off (a CT volume that ends within the head) without the
/// flat lids that its ends made: triangles that lie within 0.4 mm of the surface's utmost
/// coordinate along an axis, and face along it, where they are flat over `least_area_mm2` or more.
/// A body's own rounding has less there: a head's vertex about 200 mm^2. What is flat for the most
/// part, a box, was not cut and stays.
TriangleMesh opened_at_flat_cuts(const TriangleMesh& mesh, double least_area_mm2 = 1000.0);

}  // namespace skullstation
