#pragma once

#include <Eigen/Geometry>

#include "reconstruction/registration/input_surface.h"
#include "reconstruction/registration/oriented_points.h"

namespace skullstation {

/// Stretches points of a bone, which lie near the input already, onto it: an affine map, by robust
/// point-to-plane steps on the nearest samples with agreeing normals. Directions that the data
/// leave open change little. Gives `start` back where too little is found or where a length would
/// change by more than a quarter against it.
Eigen::Affine3d fit_affine(const OrientedPoints& points, const InputSurface& input,
                           const Eigen::Affine3d& start, double max_distance_mm);

/// The points moved, with the normals turned as the surface turns.
OrientedPoints transformed(const Eigen::Affine3d& transform, const OrientedPoints& points);

}  // namespace skullstation
