#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/simulation/placed_scene.h"
#include "capture/simulation/solid_noise.h"

namespace skullstation {

using Eigen::Vector3f;

Backdrop::Backdrop() {
  light_.reserve(static_cast<std::size_t>(rows) * (around + 1));
  for (int row = 0; row < rows; ++row) {
    const auto z = static_cast<float>(lowest_mm + row * row_mm);
    const float height = std::clamp((z + 900.0F) / 1800.0F, 0.0F, 1.0F);
    for (int column = 0; column <= around; ++column) {
      const double turn = 2.0 * std::numbers::pi * (column % around) / around;
      const Vector3f x(static_cast<float>(radius_mm * std::cos(turn)),
                       static_cast<float>(radius_mm * std::sin(turn)), z);
      const float folds = gradient_noise({x.x() / 160.0F, x.y() / 160.0F, z / 900.0F}, 11U);
      const float blotches = gradient_noise(x / 45.0F, 13U);
      light_.push_back((0.016F + 0.030F * height * height) *
                       (1.0F + 0.35F * folds + 0.20F * blotches));
    }
  }
}

Vector3f Backdrop::radiance(const Eigen::Vector3d& x_station) const {
  double turn = std::atan2(x_station.y(), x_station.x()) / (2.0 * std::numbers::pi);
  if (turn < 0.0) turn += 1.0;
  const double across = turn * around;
  const double up = std::clamp((x_station.z() - lowest_mm) / row_mm, 0.0, rows - 1.001);
  const int column = std::min(static_cast<int>(across), around - 1);
  const int row = static_cast<int>(up);
  const auto u = static_cast<float>(across - column);
  const auto v = static_cast<float>(up - row);
  const float* corner = light_.data() + static_cast<std::size_t>(row) * (around + 1) + column;
  const float light = (1.0F - v) * ((1.0F - u) * corner[0] + u * corner[1]) +
                      v * ((1.0F - u) * corner[around + 1] + u * corner[around + 2]);
  return light * Vector3f(0.95F, 1.0F, 1.08F);
}

}  // namespace skullstation
