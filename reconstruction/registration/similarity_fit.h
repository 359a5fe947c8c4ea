#pragma once

#include <Eigen/Core>

#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Which scale a closed-form fit has. Horn 1987, section 2D.
enum class FitScale {
  one,        ///< rigid
  to_target,  ///< least squares of target - transformed source: the noise is the target's
  symmetric   ///< ratio of the RMS radii: noise on both sides, the inverse fits the inverse
};

/// target_from_source in closed form (Horn 1987, by unit quaternions) for points that correspond
/// row by row, weighted (#points, not negative; empty: all 1). Never a reflection. Fails with
/// `no_result` for fewer than 3 weighted points or points (nearly) on a line.
Result<Similarity3> fit_similarity(const Points3& source, const Points3& target,
                                   const Eigen::VectorXd& weights, FitScale scale);

/// The mesh there, with normals.
TriangleMesh moved(const Similarity3& transform, TriangleMesh mesh);

}  // namespace skullstation
