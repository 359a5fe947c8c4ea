#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/triangle_mesh.h"

namespace skullstation {

/// A place on a surface that moves along when its vertices move.
struct SurfacePoint {
  Eigen::Vector3i corners = Eigen::Vector3i::Zero();   ///< vertices of one triangle
  Eigen::Vector3d weights = Eigen::Vector3d::UnitX();  ///< barycentric, their sum is 1

  Eigen::Vector3d position(const Points3& vertices) const {
    return weights[0] * vertices.row(corners[0]).transpose() +
           weights[1] * vertices.row(corners[1]).transpose() +
           weights[2] * vertices.row(corners[2]).transpose();
  }
};

/// The place of `point`, which lies on that triangle.
SurfacePoint surface_point(const TriangleMesh& mesh, int triangle, const Eigen::Vector3d& point);

/// A landmark of a template, on its surface. Bilateral ones end in " left" or " right" (the
/// person's own), as in landmarks.json.
struct TemplateLandmark {
  std::string name;
  SurfacePoint place;
};

/// Where the landmarks lie once the template's vertices have been moved to `vertices` (#landmarks
/// x 3).
Points3 landmark_positions(const std::vector<TemplateLandmark>& landmarks, const Points3& vertices);

}  // namespace skullstation
