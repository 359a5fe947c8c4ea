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

/// Crowns end and roots begin at the gums; those of one jaw reach into the other's by the overbite.
constexpr double kUpperGum_mm = -30.0;
constexpr double kUpperEdge_mm = -45.0;
constexpr double kLowerEdge_mm = -36.0;
constexpr double kLowerGum_mm = -50.0;

bool in_the_arch(const Eigen::Vector3d& canonical) {
  const double along = kArchBack_mm - canonical.y();
  if (along < 0.0) return false;
  const double radius = std::hypot(along / kArchLength_mm, canonical.x() / kArchHalfWidth_mm);
  // Millimetres off the arch, to first order.
  const double scale = radius * kArchHalfWidth_mm * kArchLength_mm /
                       std::hypot(along * kArchHalfWidth_mm / kArchLength_mm,
                                  canonical.x() * kArchLength_mm / kArchHalfWidth_mm);
  return std::abs(radius - 1.0) * scale <= kArchReach_mm;
}

}  // namespace

std::optional<double> tooth_hu(const Eigen::Vector3d& canonical, const Rigid3& closed_from_open,
                               double depth_mm) {
  const auto between = [](double z_mm, double low_mm, double high_mm) {
    return z_mm >= low_mm && z_mm <= high_mm;
  };
  const Eigen::Vector3d closed = closed_from_open * canonical;
  const bool upper = between(canonical.z(), kUpperEdge_mm, kUpperGum_mm) && in_the_arch(canonical);
  const bool lower = between(closed.z(), kLowerGum_mm, kLowerEdge_mm) && in_the_arch(closed);
  if (!upper && !lower) return std::nullopt;
  return depth_mm < kEnamel_mm ? kEnamel_hu : kDentine_hu;
}

}  // namespace skullstation
