#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/image.h"
#include "core/result.h"

namespace skullstation {

/// What a sensor and its processor do to the light.
struct SensorOptions {
  /// Exposure at gain 1 that takes radiance 1 to full scale.
  std::chrono::microseconds reference_exposure{8000};
  double full_well_electrons = 10000.0;  ///< at full scale and gain 1: sets the shot noise
  double read_noise_electrons = 4.0;
  int light_temperature_k = 5500;   ///< of the lamps: grey is grey at this white balance
  bool grey = false;                ///< 1 channel instead of RGB
  std::optional<int> jpeg_quality;  ///< 1..100; absent: no compression

  Result<void> validate() const;
};

/// One picture's settings.
struct ExposureSettings {
  std::chrono::microseconds exposure{8000};
  double gain = 1.0;
  int white_balance_k = 5500;
};

/// The 8-bit picture of linear light (3 channels). Electrons e = radiance x exposure / reference
/// x full well get normal noise of variance e + read noise^2 (Poisson's limit for large e; EMVA
/// 1288 model), are clipped at full_well / gain, weighted by the white balance, coded by the sRGB
/// curve (IEC 61966-2-1), rounded and, if asked, compressed by JPEG.
Image8 develop(const ImageF& radiance, const SensorOptions& sensor,
               const ExposureSettings& settings, std::uint64_t seed, int threads);

/// Factors on linear red, green and blue that make a black body of `light_k` look grey when the
/// camera is balanced for `light_k`, and warmer or colder otherwise; green is 1.
struct WhiteBalance {
  double red = 1.0, green = 1.0, blue = 1.0;
};
WhiteBalance white_balance(int light_k, int balance_k);

}  // namespace skullstation
