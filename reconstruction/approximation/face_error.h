#pragma once

#include <Eigen/Core>

#include "core/triangle_mesh.h"
#include "reconstruction/registration/head_template.h"

namespace skullstation {

/// How far an approximated face lies from the true one.
struct FaceError {
  int vertices = 0;  ///< of the face: face, nose, lips and eyes, not ears, scalp and neck
  double mean_mm = 0.0;
  double p95_mm = 0.0;
  double over_bone_mean_mm = 0.0;  ///< of the vertices outside nose, lips and eyes
  double features_mean_mm = 0.0;   ///< of nose, lips and eyes
  double within_band = 0.0;        ///< share whose distance is at most the band's half width
};

/// Distances of the face's vertices from the nearest point of the true skin, each vertex counting
/// alike. `head` (vertices x 3 of the template) lies in the skin's frame; `band_mm` has a half
/// width for each vertex.
FaceError face_error(const HeadTemplate& head_template, const Points3& head,
                     const Eigen::VectorXd& band_mm, const TriangleMesh& true_skin, int threads);

}  // namespace skullstation
