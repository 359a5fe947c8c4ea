#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

struct ThicknessOptions {
  /// Angle between the bone's normal and the way to the skin [deg]; beyond it the nearest skin is
  /// not the skin over this bone.
  double max_angle_deg = 75.0;
  /// Depths beyond are not soft tissue over bone [mm].
  double max_depth_mm = 60.0;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

/// Facial soft tissue thickness: the distance [mm] of each surface vertex of a fitted skull from
/// the closest point of the skin (Gietzen et al. 2019), exact; #V, NaN where it is not known:
/// `measurable` is false (inside of the skull, not observed), the skin ends there (the closest
/// point lies on its boundary), or the options say so. `skull` needs normals. Fails with
/// `bad_input` for a skin without triangles or lengths that differ.
Result<Eigen::VectorXd> tissue_thickness(const TriangleMesh& skull,
                                         const std::vector<bool>& measurable,
                                         const TriangleMesh& skin,
                                         const ThicknessOptions& options = {});

}  // namespace skullstation
