#include "capture/simulation/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace skullstation {
namespace {

using namespace std::chrono_literals;

/// Light that undoes the sRGB curve (IEC 61966-2-1).
double linear(double code) {
  const double value = code / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

ImageF even_light(float radiance, int side = 64) { return {side, side, 3, radiance}; }

SensorOptions noiseless() {
  SensorOptions sensor;
  sensor.full_well_electrons = 1e9;
  sensor.read_noise_electrons = 0.0;
  return sensor;
}

struct Statistics {
  double mean = 0.0;
  double variance = 0.0;
};

/// Of the linear signal, full scale = 1, of one channel.
Statistics statistics(const Image8& image, int channel = 0) {
  double sum = 0.0;
  double squares = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double light = linear(image.at(x, y, channel));
      sum += light;
      squares += light * light;
    }
  }
  const double count = static_cast<double>(image.width) * image.height;
  return {sum / count, squares / count - sum / count * sum / count};
}

double level(float radiance, const ExposureSettings& settings) {
  return statistics(develop(even_light(radiance, 4), noiseless(), settings, 1, 1)).mean;
}

TEST(Sensor, SignalIsLinearInExposureLightAndGainUntilItSaturates) {
  const double quantum = 0.005;  // one code value near full scale
  for (const float radiance : {0.02F, 0.1F, 0.3F}) {
    for (const auto exposure : {2000us, 8000us, 16000us}) {
      const double expected = static_cast<double>(radiance) * exposure.count() / 8000.0;
      EXPECT_NEAR(level(radiance, {exposure, 1.0, 5500}), expected, quantum);
    }
    EXPECT_NEAR(level(radiance, {8000us, 2.5, 5500}), 2.5 * static_cast<double>(radiance), quantum);
  }
  EXPECT_EQ(level(1.1F, {8000us, 1.0, 5500}), 1.0);
  EXPECT_EQ(level(0.3F, {32000us, 1.0, 5500}), 1.0);
  EXPECT_EQ(level(0.3F, {8000us, 4.0, 5500}), 1.0);
  EXPECT_EQ(level(0.0F, {8000us, 1.0, 5500}), 0.0);
}

TEST(Sensor, NoiseHasTheVarianceOfItsElectrons) {
  SensorOptions sensor;
  sensor.full_well_electrons = 2000.0;
  sensor.read_noise_electrons = 12.0;
  for (const float radiance : {0.1F, 0.3F, 0.6F}) {
    for (const double gain : {1.0, 1.5}) {
      const auto measured =
          statistics(develop(even_light(radiance, 256), sensor, {8000us, gain, 5500}, 7, 2));
      const double electrons = 2000.0 * static_cast<double>(radiance);
      const double signal = gain * electrons / 2000.0;
      const double variance = (electrons + 144.0) * gain * gain / (2000.0 * 2000.0);
      // 65536 values: the mean to 4 of its standard errors and the curve's bias from rounding,
      // the variance to 5 %.
      EXPECT_NEAR(measured.mean, signal, 4.0 * std::sqrt(variance) / 256.0 + 2e-4);
      EXPECT_NEAR(measured.variance, variance, 0.05 * variance) << radiance << " " << gain;
    }
  }
}

TEST(Sensor, NoiseOfChannelsPixelsAndFramesIsIndependent) {
  SensorOptions sensor;
  const auto frame = [&](std::uint64_t seed) {
    return develop(even_light(0.3F, 128), sensor, {}, seed, 2);
  };
  const Image8 first = frame(1);
  const Image8 second = frame(2);
  const double mean = statistics(first).mean;
  double own = 0.0;
  double channels = 0.0;
  double neighbours = 0.0;
  double frames = 0.0;
  for (int y = 0; y < first.height; ++y) {
    for (int x = 1; x < first.width; ++x) {
      const double here = linear(first.at(x, y, 0)) - mean;
      own += here * here;
      channels += here * (linear(first.at(x, y, 1)) - mean);
      neighbours += here * (linear(first.at(x - 1, y, 0)) - mean);
      frames += here * (linear(second.at(x, y, 0)) - mean);
    }
  }
  EXPECT_LT(std::abs(channels), 0.03 * own);
  EXPECT_LT(std::abs(neighbours), 0.03 * own);
  EXPECT_LT(std::abs(frames), 0.03 * own);
}

TEST(Sensor, SameBytesForAnyNumberOfThreads) {
  const ImageF light = even_light(0.3F, 50);
  const Image8 one = develop(light, {}, {}, 3, 1);
  EXPECT_EQ(one, develop(light, {}, {}, 3, 2));
  EXPECT_EQ(one, develop(light, {}, {}, 3, 5));
  EXPECT_NE(one, develop(light, {}, {}, 4, 1));
}

TEST(Sensor, AGreySensorShowsTheLuminance) {
  ImageF light(4, 4, 3);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      light.at(x, y, 0) = 0.5F;
      light.at(x, y, 1) = 0.25F;
      light.at(x, y, 2) = 0.125F;
    }
  }
  SensorOptions sensor = noiseless();
  sensor.grey = true;
  const Image8 grey = develop(light, sensor, {}, 1, 1);
  ASSERT_EQ(grey.channels, 1);
  EXPECT_NEAR(statistics(grey).mean, 0.2126 * 0.5 + 0.7152 * 0.25 + 0.0722 * 0.125, 0.004);
}

TEST(Sensor, GreyIsGreyAtTheLampsColourAndBluishWhenBalancedForWarmerLight) {
  const auto shown = [](int balance_k) {
    return develop(even_light(0.3F, 2), noiseless(), {8000us, 1.0, balance_k}, 1, 1);
  };
  const Image8 right = shown(5500);
  EXPECT_EQ(right.at(0, 0, 0), right.at(0, 0, 1));
  EXPECT_EQ(right.at(0, 0, 2), right.at(0, 0, 1));
  const Image8 warm_light_assumed = shown(3200);
  EXPECT_LT(warm_light_assumed.at(0, 0, 0), right.at(0, 0, 0));
  EXPECT_GT(warm_light_assumed.at(0, 0, 2), right.at(0, 0, 2));
  EXPECT_EQ(warm_light_assumed.at(0, 0, 1), right.at(0, 0, 1));
}

TEST(Sensor, JpegLosesMoreTheLowerItsQuality) {
  ImageF light(64, 64, 3);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        light.at(x, y, channel) = (x / 5 + y / 7) % 2 == 0 ? 0.1F : 0.5F;
      }
    }
  }
  const auto loss = [&](int quality) {
    SensorOptions sensor = noiseless();
    const Image8 exact = develop(light, sensor, {}, 1, 1);
    sensor.jpeg_quality = quality;
    const Image8 compressed = develop(light, sensor, {}, 1, 1);
    EXPECT_EQ(compressed.channels, 3);
    double squares = 0.0;
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
      squares += std::pow(static_cast<double>(exact.pixels[i]) - compressed.pixels[i], 2);
    }
    return std::sqrt(squares / static_cast<double>(exact.pixels.size()));
  };
  EXPECT_LT(loss(98), 2.0);
  EXPECT_GT(loss(20), 2.0 * loss(98));
}

TEST(Sensor, OptionsThatMakeNoSenseAreRefused) {
  EXPECT_TRUE(SensorOptions{}.validate());
  const auto refused = [](const auto& change) {
    SensorOptions sensor;
    change(sensor);
    const auto sound = sensor.validate();
    return !sound && sound.error().kind == ErrorKind::bad_input;
  };
  EXPECT_TRUE(refused([](SensorOptions& s) { s.reference_exposure = 0us; }));
  EXPECT_TRUE(refused([](SensorOptions& s) { s.full_well_electrons = 0.0; }));
  EXPECT_TRUE(refused([](SensorOptions& s) { s.read_noise_electrons = -1.0; }));
  EXPECT_TRUE(refused([](SensorOptions& s) { s.light_temperature_k = 100; }));
  EXPECT_TRUE(refused([](SensorOptions& s) { s.jpeg_quality = 0; }));
  EXPECT_TRUE(refused([](SensorOptions& s) { s.jpeg_quality = 101; }));
}

}  // namespace
}  // namespace skullstation
