#include "reconstruction/registration/surface_point.h"

namespace skullstation {

Points3 landmark_positions(const std::vector<TemplateLandmark>& landmarks,
                           const Points3& vertices) {
  Points3 positions(static_cast<Eigen::Index>(landmarks.size()), 3);
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    positions.row(i) = landmarks[static_cast<std::size_t>(i)].place.position(vertices).transpose();
  }
  return positions;
}

}  // namespace skullstation
