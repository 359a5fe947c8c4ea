#include "capture/cameras/demosaic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/random.h"

namespace skullstation {
namespace {

constexpr std::array kOrders{BayerOrder::rggb, BayerOrder::grbg, BayerOrder::gbrg,
                             BayerOrder::bggr};

/// The colour that a pixel of the mosaic measures, straight from the order's name.
int measured_channel(BayerOrder order, int x, int y) {
  static constexpr std::array<const char*, 4> kNames{"rggb", "grbg", "gbrg", "bggr"};
  const char letter = kNames[static_cast<std::size_t>(order)][2 * (y & 1) + (x & 1)];
  return letter == 'r' ? 0 : letter == 'g' ? 1 : 2;
}

Image16 mosaic_of(const Image16& colour, BayerOrder order) {
  Image16 mosaic(colour.width, colour.height, 1);
  for (int y = 0; y < colour.height; ++y) {
    for (int x = 0; x < colour.width; ++x)
      mosaic.at(x, y) = colour.at(x, y, measured_channel(order, x, y));
  }
  return mosaic;
}

TEST(Demosaic, AUniformColourComesBackExactlyEverywhere) {
  for (const BayerOrder order : kOrders) {
    for (const auto& [width, height] : {std::pair{2, 2}, {3, 5}, {4, 4}, {10, 7}}) {
      Image16 colour(width, height, 3);
      for (std::size_t i = 0; i < colour.pixels.size(); ++i) {
        colour.pixels[i] = static_cast<std::uint16_t>(900 - 400 * (i % 3));
      }
      EXPECT_EQ(demosaic(mosaic_of(colour, order), order, 1023), colour);
    }
  }
}

TEST(Demosaic, MeasuredSamplesAreKept) {
  Random random(5);
  Image16 colour(12, 11, 3);
  for (auto& level : colour.pixels) level = static_cast<std::uint16_t>(random.below(4096));
  for (const BayerOrder order : kOrders) {
    const Image16 result = demosaic(mosaic_of(colour, order), order, 4095);
    for (int y = 0; y < 11; ++y) {
      for (int x = 0; x < 12; ++x) {
        const int c = measured_channel(order, x, y);
        EXPECT_EQ(result.at(x, y, c), colour.at(x, y, c));
      }
    }
  }
}

TEST(Demosaic, ALinearRampComesBackExactlyAwayFromTheBorder) {
  Image16 colour(16, 16, 3);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      for (int c = 0; c < 3; ++c)
        colour.at(x, y, c) = static_cast<std::uint16_t>(100 * c + 20 * x + 8 * y);
    }
  }
  for (const BayerOrder order : kOrders) {
    const Image16 result = demosaic(mosaic_of(colour, order), order, 1023);
    for (int y = 2; y < 14; ++y) {
      for (int x = 2; x < 14; ++x) {
        for (int c = 0; c < 3; ++c)
          EXPECT_EQ(result.at(x, y, c), colour.at(x, y, c)) << x << ", " << y;
      }
    }
  }
}

TEST(Demosaic, TheFiltersAreThoseOfThePaper) {
  // The response to a single bright pixel is the filter itself (figure 2 of the paper, in
  // eighths); here at a red pixel of RGGB for green and blue at and around it.
  Image16 mosaic(9, 9, 1);
  mosaic.at(4, 4) = 800;  // red site
  const Image16 response = demosaic(mosaic, BayerOrder::rggb, 65535);
  EXPECT_EQ(response.at(4, 4, 0), 800);
  EXPECT_EQ(response.at(4, 4, 1), 400);  // 4/8
  EXPECT_EQ(response.at(4, 4, 2), 600);  // 6/8
  EXPECT_EQ(response.at(3, 4, 0), 400);  // beside in its row: 4/8
  EXPECT_EQ(response.at(4, 5, 0), 400);  // above in its column: 4/8
  EXPECT_EQ(response.at(3, 3, 0), 200);  // diagonal: 2/8
  EXPECT_EQ(response.at(2, 4, 1), 0);    // -1/8, clamped
}

TEST(Demosaic, ResultsStayInRangeAndTheMirroredBorderKeepsThePhase) {
  Random random(9);
  Image16 mosaic(6, 6, 1);
  for (auto& level : mosaic.pixels) level = random.below(2) == 0 ? 0 : 255;
  for (const BayerOrder order : kOrders) {
    const Image16 result = demosaic(mosaic, order, 255);
    for (const auto level : result.pixels) EXPECT_LE(level, 255);
  }
}

TEST(Demosaic, FineTextureIsTruerThanByBilinearInterpolation) {
  // White noise, equal in all channels: the error of an interpolated green is the difference of
  // the filter from the identity, so its RMS is sqrt(1/4 + 4/16 + 4/64) = 0.75 of the texture's,
  // where the mean of the four neighbours errs by sqrt(1 + 4/16) = 1.118.
  Random random(21);
  Image16 truth(200, 200, 3);
  for (std::size_t i = 0; i < truth.pixels.size(); i += 3) {
    const auto level = static_cast<std::uint16_t>(32768 + 1000 * random.normal());
    std::fill_n(truth.pixels.begin() + static_cast<std::ptrdiff_t>(i), 3, level);
  }
  const Image16 result = demosaic(mosaic_of(truth, BayerOrder::grbg), BayerOrder::grbg, 65535);
  double sum = 0.0;
  int count = 0;
  for (int y = 2; y < 198; ++y) {
    for (int x = 2; x < 198; ++x) {
      if (measured_channel(BayerOrder::grbg, x, y) == 1) continue;
      sum += std::pow(result.at(x, y, 1) - truth.at(x, y, 1), 2);
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(sum / count), 750.0, 15.0);
}

}  // namespace
}  // namespace skullstation
