#include "capture/simulation/sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "capture/simulation/srgb.h"
#include "core/parallel.h"
#include "core/random.h"

namespace skullstation {

namespace {

tl::unexpected<Error> bad_option(const char* option, const char* what) {
  return fail(ErrorKind::bad_input, fmt::format("simulated camera, {}", option), what);
}

/// Code values of light, finely enough for the steepest part of the sRGB curve.
class ResponseCurve {
 public:
  ResponseCurve() : codes_(steps + 1) {
    for (int i = 0; i <= steps; ++i) {
      codes_[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(
          std::lround(srgb_from_linear(static_cast<float>(i) / static_cast<float>(steps))));
    }
  }
  std::uint8_t operator()(float light) const {
    const float at = std::clamp(light, 0.0F, 1.0F) * static_cast<float>(steps);
    return codes_[static_cast<std::size_t>(at + 0.5F)];
  }

 private:
  static constexpr int steps = 1 << 16;
  std::vector<std::uint8_t> codes_;
};

/// Three independent standard normals of a pixel (Box & Muller 1958).
std::array<float, 3> normals(std::uint64_t pixel_seed) {
  Random random(pixel_seed);
  const auto radius = [&] {
    return std::sqrt(-2.0F * std::log(1.0F - static_cast<float>(random.bits() >> 40) * 0x1.0p-24F));
  };
  const auto turn = [&] {
    return 2.0F * std::numbers::pi_v<float> * static_cast<float>(random.uniform());
  };
  const float first_radius = radius();
  const float first_turn = turn();
  return {first_radius * std::cos(first_turn), first_radius * std::sin(first_turn),
          radius() * std::cos(turn())};
}

/// CIE 1931 chromaticity of a black body (Kim et al. 2002, US patent 7024034; 1667..25000 K) as
/// linear sRGB with green 1.
std::array<double, 3> black_body_rgb(double kelvin) {
  const double t = 1000.0 / kelvin;
  const double x = kelvin <= 4000.0 ? ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
                                    : ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390;
  double y = 0.0;
  if (kelvin <= 2222.0) {
    y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683;
  } else if (kelvin <= 4000.0) {
    y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867;
  } else {
    y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483;
  }
  const double cie_x = x / y;
  const double cie_z = (1.0 - x - y) / y;
  const double red = 3.2404542 * cie_x - 1.5371385 - 0.4985314 * cie_z;
  const double green = -0.9692660 * cie_x + 1.8760108 + 0.0415560 * cie_z;
  const double blue = 0.0556434 * cie_x - 0.2040259 + 1.0572252 * cie_z;
  return {red / green, 1.0, blue / green};
}

void compress(Image8& image, int quality) {
  const int type = image.channels == 3 ? CV_8UC3 : CV_8UC1;
  cv::Mat pixels(image.height, image.width, type, image.pixels.data());
  if (image.channels == 3) cv::cvtColor(pixels, pixels, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", pixels, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  if (image.channels == 3) cv::cvtColor(decoded, decoded, cv::COLOR_BGR2RGB);
  std::copy_n(decoded.data, image.pixels.size(), image.pixels.begin());
}

}  // namespace

Result<void> SensorOptions::validate() const {
  if (reference_exposure.count() <= 0) return bad_option("reference_exposure", "must be positive");
  if (!(full_well_electrons > 0.0)) return bad_option("full_well_electrons", "must be positive");
  if (!(read_noise_electrons >= 0.0)) {
    return bad_option("read_noise_electrons", "must not be negative");
  }
  if (light_temperature_k < 2000 || light_temperature_k > 12000) {
    return bad_option("light_temperature_k", "must be 2000 to 12000");
  }
  if (jpeg_quality && (*jpeg_quality < 1 || *jpeg_quality > 100)) {
    return bad_option("jpeg_quality", "must be 1 to 100");
  }
  return {};
}

WhiteBalance white_balance(int light_k, int balance_k) {
  const auto light = black_body_rgb(light_k);
  const auto balance = black_body_rgb(balance_k);
  return {light[0] / balance[0], 1.0, light[2] / balance[2]};
}

Image8 develop(const ImageF& radiance, const SensorOptions& sensor,
               const ExposureSettings& settings, std::uint64_t seed, int threads) {
  const ResponseCurve response;
  const WhiteBalance balance = white_balance(sensor.light_temperature_k, settings.white_balance_k);
  const float balances[3] = {static_cast<float>(balance.red), static_cast<float>(balance.green),
                             static_cast<float>(balance.blue)};
  const auto full_well = static_cast<float>(sensor.full_well_electrons);
  const auto read_variance =
      static_cast<float>(sensor.read_noise_electrons * sensor.read_noise_electrons);
  const auto electrons_per_radiance = static_cast<float>(
      sensor.full_well_electrons * static_cast<double>(settings.exposure.count()) /
      static_cast<double>(sensor.reference_exposure.count()));
  const float signal_per_electron = static_cast<float>(settings.gain) / full_well;

  Image8 image(radiance.width, radiance.height, sensor.grey ? 1 : 3);
  parallel_for(radiance.height, threads, [&](int y) {
    for (int x = 0; x < radiance.width; ++x) {
      const std::array<float, 3> noise = normals(
          mix(seed, static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(radiance.width) +
                        static_cast<std::uint64_t>(x)));
      const auto signal = [&](int channel, float light) {
        const float electrons = electrons_per_radiance * light;
        return signal_per_electron *
               std::clamp(electrons + std::sqrt(electrons + read_variance) *
                                          noise[static_cast<std::size_t>(channel)],
                          0.0F, full_well);
      };
      if (sensor.grey) {
        const float luminance = 0.2126F * radiance.at(x, y, 0) + 0.7152F * radiance.at(x, y, 1) +
                                0.0722F * radiance.at(x, y, 2);
        image.at(x, y) = response(signal(0, luminance));
        continue;
      }
      for (int channel = 0; channel < 3; ++channel) {
        image.at(x, y, channel) =
            response(balances[channel] * signal(channel, radiance.at(x, y, channel)));
      }
    }
  });
  if (sensor.jpeg_quality) compress(image, *sensor.jpeg_quality);
  return image;
}

}  // namespace skullstation
