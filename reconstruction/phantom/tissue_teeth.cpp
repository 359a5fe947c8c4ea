#include "reconstruction/phantom/tissue_teeth.h"

#include <cmath>

namespace skullstation {

namespace {

constexpr double kEnamel_hu = 2500.0;
constexpr double kDentine_hu = 1700.0;
constexpr double kEnamel_mm = 1.2;

/// The dental arch seen from above: half an ellipse open to the back.
constexpr double kArchBack_mm = -52.0;
constexpr double kArchLength_mm = 45.0;
constexpr double kArchHalfWidth_mm = 26.0;
constexpr double kArchReach_mm = 6.0;  ///< half the breadth of a tooth and some more

/// Crowns end and roots begin at the gums.
constexpr double kUpperGum_mm = -30.0;
constexpr double kLowerGum_mm = -50.0;

}  // namespace

std::optional<double> tooth_hu(const Eigen::Vector3d& canonical, double depth_mm) {
  if (canonical.z() > kUpperGum_mm || canonical.z() < kLowerGum_mm) return std::nullopt;
  const double along = kArchBack_mm - canonical.y();
  if (along < 0.0) return std::nullopt;
  const double radius = std::hypot(along / kArchLength_mm, canonical.x() / kArchHalfWidth_mm);
  // Millimetres off the arch, to first order.
  const double scale = radius * kArchHalfWidth_mm * kArchLength_mm /
                       std::hypot(along * kArchHalfWidth_mm / kArchLength_mm,
                                  canonical.x() * kArchLength_mm / kArchHalfWidth_mm);
  if (std::abs(radius - 1.0) * scale > kArchReach_mm) return std::nullopt;
  return depth_mm < kEnamel_mm ? kEnamel_hu : kDentine_hu;
}

}  // namespace skullstation
