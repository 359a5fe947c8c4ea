#include "reconstruction/anatomy/feature_rules.h"

#include <Eigen/Geometry>

namespace skullstation {

ExpectedNose expected_nose(const NoseBones& bones) {
  const double x = (bones.nasion - bones.acanthion).norm();
  const double y = (bones.rhinion - bones.subspinale).norm();
  const Eigen::Vector3d across = (bones.porion_left - bones.porion_right).normalized();
  ExpectedNose nose;
  nose.down = (bones.prosthion - bones.nasion).normalized();
  nose.forward = nose.down.cross(across).normalized();
  nose.down_mm = 0.9 * x - 2.0;
  nose.forward_mm = 0.83 * y - 3.5;
  return nose;
}

Eigen::Vector3d expected_pronasale(const NoseBones& bones, double forward_residual_mm,
                                   double down_residual_mm) {
  const ExpectedNose nose = expected_nose(bones);
  return bones.nasion + (nose.down_mm + down_residual_mm) * nose.down +
         (nose.forward_mm + forward_residual_mm) * nose.forward;
}

Eigen::Vector3d expected_lid(const OrbitBones& bones) {
  constexpr double lateral_mm = 2.3;
  constexpr double up_mm = 1.4;
  constexpr double cornea_mm = 16.0;
  constexpr double lid_mm = 2.0;
  const double side = bones.ectoconchion.x() > bones.dacryon.x() ? 1.0 : -1.0;
  return {0.5 * (bones.dacryon.x() + bones.ectoconchion.x()) + side * lateral_mm,
          bones.ectoconchion.y() - cornea_mm - lid_mm,
          0.5 * (bones.above.z() + bones.below.z()) + up_mm};
}

}  // namespace skullstation
