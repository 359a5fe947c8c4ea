#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace skullstation {

/// IEC 61966-2-1: light in [0, 1] of an sRGB code value.
inline float linear_from_srgb(std::uint8_t code) {
  const float c = static_cast<float>(code) / 255.0F;
  return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
}

/// IEC 61966-2-1: the sRGB code value in [0, 255], not rounded, of light in [0, 1].
inline float srgb_from_linear(float light) {
  const float l = std::clamp(light, 0.0F, 1.0F);
  return 255.0F * (l <= 0.0031308F ? 12.92F * l : 1.055F * std::pow(l, 1.0F / 2.4F) - 0.055F);
}

}  // namespace skullstation
