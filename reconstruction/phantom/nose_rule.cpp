#include "reconstruction/phantom/nose_rule.h"

#include <Eigen/Geometry>

namespace skullstation {

Eigen::Vector3d expected_pronasale(const NoseBones& bones, double forward_residual_mm,
                                   double down_residual_mm) {
  const double x = (bones.nasion - bones.acanthion).norm();
  const double y = (bones.rhinion - bones.subspinale).norm();
  const Eigen::Vector3d down = (bones.prosthion - bones.nasion).normalized();
  const Eigen::Vector3d across = (bones.porion_left - bones.porion_right).normalized();
  const Eigen::Vector3d forward = down.cross(across).normalized();
  return bones.nasion + (0.9 * x - 2.0 + down_residual_mm) * down +
         (0.83 * y - 3.5 + forward_residual_mm) * forward;
}

}  // namespace skullstation
