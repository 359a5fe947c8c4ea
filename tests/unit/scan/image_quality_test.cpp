#include "capture/scan/image_quality.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "core/units.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

constexpr int width = 320;
constexpr int height = 240;

/// A picture of a textured ball before a dark backdrop, defined at every point, so that shifts,
/// turns and blur are exact.
struct BallPicture {
  double center_x = 160.0, center_y = 120.0, radius = 80.0;
  double shift_x = 0.0, shift_y = 0.0;  // of ball and texture
  double turn_deg = 0.0;                // of the texture about the ball's centre
  double blur_sd_px = 0.0;
  double contrast = 1.0;
  double gain = 1.0;
  double noise_sd = 2.0;
  std::uint64_t noise_seed = 1;

  struct Wave {
    double frequency_x, frequency_y, phase, amplitude;
  };

  /// Waves of 3 to 48 px in all directions; blur acts on each by its own factor.
  std::vector<Wave> waves() const {
    std::vector<Wave> all;
    Random random(11);
    for (int i = 0; i < 60; ++i) {
      const double length_px = 3.0 * std::pow(16.0, i / 59.0);
      const double frequency = 2.0 * std::numbers::pi / length_px;
      const double direction = random.uniform(0.0, 2.0 * std::numbers::pi);
      const double phase = random.uniform(0.0, 2.0 * std::numbers::pi);
      const double damped = std::exp(-0.5 * std::pow(frequency * blur_sd_px, 2.0));
      all.push_back({frequency * std::cos(direction), frequency * std::sin(direction), phase,
                     6.0 * contrast * damped});
    }
    return all;
  }

  Image8 render() const {
    Image8 image(width, height, 1);
    Random noise(noise_seed);
    const std::vector<Wave> all_waves = waves();
    const double c = std::cos(radians(turn_deg));
    const double s = std::sin(radians(turn_deg));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double dx = x + 0.5 - center_x - shift_x;
        const double dy = y + 0.5 - center_y - shift_y;
        double level = 15.0;
        if (std::hypot(dx, dy) < radius) {
          level = 130.0;
          for (const Wave& wave : all_waves) {
            level += wave.amplitude * std::sin(wave.frequency_x * (c * dx + s * dy) +
                                               wave.frequency_y * (c * dy - s * dx) + wave.phase);
          }
        }
        image.at(x, y) = static_cast<std::uint8_t>(
            std::clamp(std::lround(gain * level + noise.normal(0.0, noise_sd)), 0L, 255L));
      }
    }
    return image;
  }
};

ViewQuality measured(BallPicture picture, BallPicture earlier) {
  picture.noise_seed = 100;
  earlier.noise_seed = 200;
  const Image8 before = earlier.render();
  return measure_view(picture.render(), &before, std::nullopt);
}

ViewQuality measured(const BallPicture& picture) { return measured(picture, picture); }

// ---- sharpness ----

TEST(Sharpness, FallsSteeplyWithBlur) {
  double last = 1e9;
  double sharp = 0.0;
  for (const double blur_sd_px : {0.0, 0.5, 1.0, 1.5, 2.0}) {
    BallPicture picture;
    picture.blur_sd_px = blur_sd_px;
    const double sharpness = measured(picture).sharpness;
    if (blur_sd_px == 0.0) sharp = sharpness;
    EXPECT_LT(sharpness, 0.8 * last) << blur_sd_px;
    last = sharpness;
  }
  EXPECT_LT(last, 0.1 * sharp);
}

TEST(Sharpness, DependsNeitherOnContrastNorOnLightNorOnNoise) {
  const double reference = measured(BallPicture{}).sharpness;
  BallPicture pale;
  pale.contrast = 0.4;
  EXPECT_NEAR(measured(pale).sharpness, reference, 0.1 * reference);
  BallPicture dim;
  dim.gain = 0.6;
  EXPECT_NEAR(measured(dim).sharpness, reference, 0.1 * reference);
  BallPicture noisy;
  noisy.noise_sd = 6.0;
  EXPECT_NEAR(measured(noisy).sharpness, reference, 0.1 * reference);
}

TEST(Sharpness, OfOneCleanFrameIsThatOfTwo) {
  BallPicture clean;
  clean.noise_sd = 0.0;
  const double reference = measured(clean).sharpness;
  EXPECT_NEAR(measure_view(clean.render(), nullptr, std::nullopt).sharpness, reference,
              1e-6 * reference);
}

// ---- motion ----

TEST(Motion, OfTwoFramesAtRestIsNone) {
  EXPECT_LT(measured(BallPicture{}).motion_px, 0.1);
  BallPicture noisy;
  noisy.noise_sd = 6.0;
  EXPECT_LT(measured(noisy).motion_px, 0.2);
}

TEST(Motion, SmallShiftsAreMeasured) {
  for (const double shift : {0.2, 0.5, 1.0}) {
    BallPicture moved;
    moved.shift_x = 0.8 * shift;
    moved.shift_y = 0.6 * shift;
    EXPECT_NEAR(measured(moved, {}).motion_px, shift, 0.3 * shift + 0.03);
  }
}

TEST(Motion, LargeShiftsAreNoticed) {
  const QualityGates gates;
  for (const double shift : {3.0, 10.0, 40.0}) {
    BallPicture moved;
    moved.shift_x = shift;
    EXPECT_GT(measured(moved, {}).motion_px, 2.0 * gates.max_motion_px) << shift;
  }
}

TEST(Motion, ATurnAboutTheMiddleIsNoticed) {
  BallPicture turned;
  turned.turn_deg = 1.0;  // 1.4 px at the ball's rim, nothing in its middle
  EXPECT_GT(measured(turned, {}).motion_px, 0.6);
  EXPECT_LT(measured(turned, {}).motion_px, 1.6);
}

TEST(Motion, FlickerIsNone) {
  BallPicture brighter;
  brighter.gain = 1.04;
  EXPECT_LT(measured(brighter, {}).motion_px, 0.08);
}

// ---- levels and border ----

TEST(Levels, AreThoseOfTheSpecimen) {
  Image8 image(200, 200, 1, 10);
  for (int y = 40; y < 160; ++y) {
    for (int x = 40; x < 160; ++x) image.at(x, y) = x < 52 ? 255 : 100;
  }
  const ViewQuality quality = measure_view(image, nullptr, std::nullopt);
  EXPECT_NEAR(quality.specimen_percent, 36.0, 0.01);
  EXPECT_NEAR(quality.clipped_percent, 10.0, 0.01);
  EXPECT_NEAR(quality.dark_percent, 0.0, 0.01);
  EXPECT_NEAR(quality.mean_level, 0.1 * 255.0 + 0.9 * 100.0, 0.01);
  EXPECT_EQ(quality.border_percent, 0.0);
  EXPECT_EQ(quality.motion_px, 0.0);
}

TEST(Levels, OneClippedChannelIsClipped) {
  Image8 image(200, 200, 3, 10);
  for (int y = 40; y < 160; ++y) {
    for (int x = 40; x < 160; ++x) {
      image.at(x, y, 0) = x < 52 ? 255 : 120;
      image.at(x, y, 1) = image.at(x, y, 2) = 100;
    }
  }
  EXPECT_NEAR(measure_view(image, nullptr, std::nullopt).clipped_percent, 10.0, 0.01);
}

TEST(Border, TellsASpecimenThatIsCutOff) {
  BallPicture whole;
  EXPECT_EQ(measured(whole).border_percent, 0.0);
  BallPicture cut;
  cut.center_y = 40.0;  // the frame's edge runs through the ball, 40 px from its middle
  const double chord_px = 2.0 * std::sqrt(80.0 * 80.0 - 40.0 * 40.0);
  const double border_px = 2.0 * (width + height);
  EXPECT_NEAR(measured(cut).border_percent, 100.0 * chord_px / border_px, 1.0);
}

TEST(MeasureView, BlackWhiteAndTinyImagesAreMeasuredToo) {
  for (const int level : {0, 255}) {
    const Image8 image(64, 48, 3, static_cast<std::uint8_t>(level));
    const ViewQuality quality = measure_view(image, &image, CharucoBoard{});
    EXPECT_EQ(quality.board_corners, 0);
    EXPECT_EQ(quality.specimen_percent, 0.0);
    EXPECT_EQ(quality.motion_px, 0.0);
  }
  const Image8 tiny(3, 2, 1, 99);
  EXPECT_EQ(measure_view(tiny, &tiny, std::nullopt).sharpness, 0.0);
}

// ---- gates ----

ViewQuality good_quality() {
  ViewQuality quality;
  quality.sharpness = 0.6;
  quality.mean_level = 140.0;
  quality.motion_px = 0.05;
  quality.specimen_percent = 10.0;
  quality.board_corners = 120;
  return quality;
}

TEST(Gates, LetGoodViewsPass) {
  const std::vector<double> accepted(20, 0.7);
  EXPECT_EQ(failed_gate(good_quality(), {}, accepted, true), std::nullopt);
  EXPECT_EQ(failed_gate(good_quality(), {}, {}, true), std::nullopt);
}

TEST(Gates, SayWhatIsWrong) {
  const std::pair<std::function<void(ViewQuality&)>, const char*> cases[] = {
      {[](ViewQuality& q) { q.specimen_percent = 0.5; },
       "no specimen seen: it covers 0.50 % of the frame, 1.00 are needed"},
      {[](ViewQuality& q) { q.clipped_percent = 3.0; },
       "overexposed: 3.0 % of the specimen is clipped, 1.0 are allowed"},
      {[](ViewQuality& q) { q.mean_level = 240.0; }, "overexposed: the specimen's mean level"},
      {[](ViewQuality& q) { q.dark_percent = 60.0; }, "underexposed: 60.0 % of the specimen"},
      {[](ViewQuality& q) { q.mean_level = 20.0; }, "underexposed: the specimen's mean level"},
      {[](ViewQuality& q) { q.border_percent = 2.0; },
       "specimen cut off: it touches 2.0 % of the frame's border, 0.5 are allowed"},
      {[](ViewQuality& q) { q.motion_px = 0.8; },
       "moving: 0.80 px between two frames, 0.30 are allowed"},
      {[](ViewQuality& q) { q.board_corners = 11; },
       "board not visible: 11 corners seen, 12 are needed"},
      {[](ViewQuality& q) { q.sharpness = 0.01; }, "not sharp: 0.010, 0.020 is needed"},
      {[](ViewQuality& q) { q.sharpness = 0.1; },
       "not sharp: 0.100, 0.140 is needed (20 % of this camera's median)"},
  };
  const std::vector<double> accepted{0.1, 0.7, 9.0, 0.7, 0.7};
  for (const auto& [spoil, expected] : cases) {
    ViewQuality quality = good_quality();
    spoil(quality);
    const std::optional<std::string> reason = failed_gate(quality, {}, accepted, true);
    ASSERT_TRUE(reason) << expected;
    EXPECT_THAT(*reason, HasSubstr(expected));
  }
}

TEST(Gates, TheMedianCountsOnceThereAreEnoughViewsAndABoardWhereThereIsOne) {
  ViewQuality soft = good_quality();
  soft.sharpness = 0.1;
  EXPECT_FALSE(failed_gate(soft, {}, std::vector<double>(4, 0.7), true));
  EXPECT_TRUE(failed_gate(soft, {}, std::vector<double>(5, 0.7), true));
  ViewQuality no_board = good_quality();
  no_board.board_corners = 0;
  EXPECT_FALSE(failed_gate(no_board, {}, {}, false));
  EXPECT_TRUE(failed_gate(no_board, {}, {}, true));
}

TEST(Gates, SenselessOnesAreUsageErrors) {
  EXPECT_TRUE(QualityGates{}.validate());
  const std::pair<std::function<void(QualityGates&)>, const char*> cases[] = {
      {[](QualityGates& g) { g.min_sharpness = -1.0; }, "min_sharpness: must be 0 or more, not -1"},
      {[](QualityGates& g) { g.max_motion_px = std::nan(""); }, "max_motion_px: must be 0 or more"},
      {[](QualityGates& g) { g.min_board_corners = -1; }, "min_board_corners: must be 0 or more"},
      {[](QualityGates& g) { g.max_border_percent = 101.0; },
       "max_border_percent: must be from 0 to 100, not 101"},
      {[](QualityGates& g) { g.min_sharpness_of_median = 1.5; },
       "min_sharpness_of_median: must be from 0 to 1, not 1.5"},
      {[](QualityGates& g) { g.min_mean_level = 230.0; },
       "min_mean_level: must be below max_mean_level, both from 0 to 255, not 230"},
  };
  for (const auto& [spoil, expected] : cases) {
    QualityGates gates;
    spoil(gates);
    ASSERT_FALSE(gates.validate()) << expected;
    EXPECT_EQ(gates.validate().error().kind, ErrorKind::usage);
    EXPECT_THAT(gates.validate().error().message(), HasSubstr(expected));
  }
}

}  // namespace
}  // namespace skullstation
