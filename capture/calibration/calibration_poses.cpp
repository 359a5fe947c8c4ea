#include <array>
#include <cmath>
#include <numbers>

#include "capture/calibration/camera_calibration.h"
#include "core/units.h"

namespace skullstation {

double filling_distance_mm(const CharucoBoard& board, const Lens& lens) {
  const double by_width = lens.fx * board.width_mm() / lens.width;
  const double by_height = lens.fy * board.height_mm() / lens.height;
  return std::max(by_width, by_height) / 0.8;
}

std::vector<Rigid3> calibration_poses(const Lens& lens, double distance_mm) {
  constexpr int count = 20;
  // Where the board's centre is seen: the middle, then towards the corners and edges in turn.
  constexpr std::array<std::array<double, 2>, 9> places = {{{0.50, 0.50},
                                                            {0.25, 0.28},
                                                            {0.75, 0.72},
                                                            {0.75, 0.28},
                                                            {0.25, 0.72},
                                                            {0.50, 0.25},
                                                            {0.22, 0.50},
                                                            {0.50, 0.75},
                                                            {0.78, 0.50}}};
  constexpr std::array<double, 4> tilts_deg = {35.0, 22.0, 42.0, 30.0};
  constexpr std::array<double, 3> distances = {1.0, 0.9, 1.1};
  constexpr std::array<double, 5> rolls_deg = {0.0, 12.0, -90.0, -15.0, 75.0};
  // A board held upright before the camera: its x to the right, its y up, facing it.
  const Eigen::Quaterniond facing(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto& place = places[at % places.size()];
    const double distance = distance_mm * distances[at % distances.size()];
    const Eigen::Vector3d ray((place[0] * lens.width - lens.cx) / lens.fx,
                              (place[1] * lens.height - lens.cy) / lens.fy, 1.0);
    // Tilted about an axis in the image plane, which goes round by the golden angle.
    const double azimuth = radians(137.50776 * i);
    const Eigen::Vector3d axis(std::cos(azimuth), std::sin(azimuth), 0.0);
    const Eigen::AngleAxisd tilt(radians(tilts_deg[at % tilts_deg.size()]), axis);
    const Eigen::AngleAxisd roll(radians(rolls_deg[at % rolls_deg.size()]),
                                 Eigen::Vector3d::UnitZ());
    poses.push_back({(tilt * facing * roll).normalized(), distance * ray});
  }
  return poses;
}

}  // namespace skullstation
