#include "capture/cameras/pixel_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"

namespace skullstation {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::HasSubstr;

struct Rgb {
  int r, g, b;
};

Rgb pixel(const Image8& image, int x, int y) {
  return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}

void expect_rgb(const Image8& image, int x, int y, const Rgb& expected, int tolerance = 0) {
  const Rgb actual = pixel(image, x, y);
  EXPECT_NEAR(actual.r, expected.r, tolerance) << x << ", " << y;
  EXPECT_NEAR(actual.g, expected.g, tolerance) << x << ", " << y;
  EXPECT_NEAR(actual.b, expected.b, tolerance) << x << ", " << y;
}

Image8 decoded(const RawImageFormat& format, const Bytes& bytes) {
  Result<Image8> image = decode_image(format, bytes);
  if (!image) {
    ADD_FAILURE() << image.error().message();
    return Image8(format.width, format.height, 3);
  }
  return std::move(*image);
}

RawImageFormat raw(PixelFormat pixels, int width, int height, std::size_t padding = 0) {
  return {.pixels = pixels,
          .width = width,
          .height = height,
          .stride_bytes = row_bytes(pixels, width) + padding};
}

/// Y'CbCr of a colour by the definition (ITU-R BT.601-7 section 2.5.3), in floating point.
struct Ycbcr {
  std::uint8_t y, cb, cr;
};

Ycbcr ycbcr(const Rgb& colour, double kr, double kb, SampleRange range) {
  const double r = colour.r / 255.0;
  const double g = colour.g / 255.0;
  const double b = colour.b / 255.0;
  const double y = kr * r + (1 - kr - kb) * g + kb * b;
  const double cb = (b - y) / (2 * (1 - kb));
  const double cr = (r - y) / (2 * (1 - kr));
  const auto level = [](double value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
  };
  if (range == SampleRange::full)
    return {level(255 * y), level(128 + 255 * cb), level(128 + 255 * cr)};
  return {level(16 + 219 * y), level(128 + 224 * cb), level(128 + 224 * cr)};
}

const std::vector<Rgb> kColours{{0, 0, 0},     {255, 255, 255}, {128, 128, 128}, {255, 0, 0},
                                {0, 255, 0},   {0, 0, 255},     {255, 255, 0},   {0, 255, 255},
                                {255, 0, 255}, {200, 180, 150}, {17, 93, 201}};

TEST(Fourcc, NamesGoBothWays) {
  EXPECT_EQ(fourcc_name(V4L2_PIX_FMT_YUYV), "YUYV");
  EXPECT_EQ(fourcc_name(V4L2_PIX_FMT_Y16), "Y16");
  EXPECT_EQ(fourcc_name(V4L2_PIX_FMT_Y16_BE), "Y16-BE");
  EXPECT_EQ(fourcc_name(1), "????");
  EXPECT_EQ(fourcc_from_name("MJPG"), V4L2_PIX_FMT_MJPEG);
  EXPECT_EQ(fourcc_from_name("Y16"), V4L2_PIX_FMT_Y16);
  EXPECT_FALSE(fourcc_from_name(""));
  EXPECT_FALSE(fourcc_from_name("MJPEG"));
}

TEST(Fourcc, EveryBayerFormatSaysItsOrderBitsAndPacking) {
  EXPECT_EQ(pixel_format_from_fourcc(V4L2_PIX_FMT_SGRBG8),
            (PixelFormat{PixelLayout::bayer, 8, false, BayerOrder::grbg}));
  EXPECT_EQ(pixel_format_from_fourcc(V4L2_PIX_FMT_SBGGR10P),
            (PixelFormat{PixelLayout::bayer, 10, true, BayerOrder::bggr}));
  EXPECT_EQ(pixel_format_from_fourcc(V4L2_PIX_FMT_SRGGB12),
            (PixelFormat{PixelLayout::bayer, 12, false, BayerOrder::rggb}));
  EXPECT_EQ(pixel_format_from_fourcc(V4L2_PIX_FMT_SGBRG16),
            (PixelFormat{PixelLayout::bayer, 16, false, BayerOrder::gbrg}));
  EXPECT_FALSE(pixel_format_from_fourcc(V4L2_PIX_FMT_H264));
}

struct YuvCase {
  const char* name;
  YcbcrEncoding encoding;
  std::optional<SampleRange> range;
  double kr, kb;
};

class YuvColours : public ::testing::TestWithParam<YuvCase> {
 protected:
  /// A full-range sample holds 8 bits, a limited one a little less: the round trip loses that.
  static constexpr int kTolerance = 2;
  SampleRange range() const { return GetParam().range.value_or(SampleRange::limited); }
};

TEST_P(YuvColours, Packed422GivesTheColoursBackForEverySampleOrder) {
  for (const PixelLayout layout : {PixelLayout::yuyv, PixelLayout::uyvy}) {
    for (const Rgb& colour : kColours) {
      const Ycbcr code = ycbcr(colour, GetParam().kr, GetParam().kb, range());
      RawImageFormat format = raw({layout}, 4, 2);
      format.encoding = GetParam().encoding;
      format.range = GetParam().range;
      Bytes bytes;
      for (int pair = 0; pair < 4; ++pair) {
        if (layout == PixelLayout::yuyv)
          bytes.insert(bytes.end(), {code.y, code.cb, code.y, code.cr});
        if (layout == PixelLayout::uyvy)
          bytes.insert(bytes.end(), {code.cb, code.y, code.cr, code.y});
      }
      expect_rgb(decoded(format, bytes), 3, 1, colour, kTolerance);
    }
  }
}

TEST_P(YuvColours, SemiPlanar420GivesTheColoursBackForEverySampleOrder) {
  for (const PixelLayout layout : {PixelLayout::nv12, PixelLayout::nv21}) {
    for (const Rgb& colour : kColours) {
      const Ycbcr code = ycbcr(colour, GetParam().kr, GetParam().kb, range());
      RawImageFormat format = raw({layout}, 2, 2);
      format.encoding = GetParam().encoding;
      format.range = GetParam().range;
      const bool nv12 = layout == PixelLayout::nv12;
      const Bytes bytes{
          code.y, code.y, code.y, code.y, nv12 ? code.cb : code.cr, nv12 ? code.cr : code.cb};
      expect_rgb(decoded(format, bytes), 1, 1, colour, kTolerance);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Encodings, YuvColours,
    ::testing::Values(YuvCase{"default", YcbcrEncoding::bt601, {}, 0.299, 0.114},
                      YuvCase{"bt601_full", YcbcrEncoding::bt601, SampleRange::full, 0.299, 0.114},
                      YuvCase{"bt709", YcbcrEncoding::bt709, SampleRange::limited, 0.2126, 0.0722},
                      YuvCase{"bt709_full", YcbcrEncoding::bt709, SampleRange::full, 0.2126,
                              0.0722},
                      YuvCase{"bt2020", YcbcrEncoding::bt2020, {}, 0.2627, 0.0593},
                      YuvCase{"smpte240m", YcbcrEncoding::smpte240m, {}, 0.212, 0.087}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(DecodeImage, Bt601LimitedRangeHasItsTextbookValues) {
  // ITU-R BT.601 limited range: 75 % colour bars as every test generator sends them.
  const RawImageFormat format = raw({PixelLayout::yuyv}, 2, 1);
  expect_rgb(decoded(format, {16, 128, 235, 128}), 0, 0, {0, 0, 0});
  expect_rgb(decoded(format, {16, 128, 235, 128}), 1, 0, {255, 255, 255});
  expect_rgb(decoded(format, {81, 90, 81, 240}), 0, 0, {255, 0, 0}, 1);
  expect_rgb(decoded(format, {145, 54, 145, 34}), 0, 0, {0, 255, 0}, 1);
  expect_rgb(decoded(format, {41, 240, 41, 110}), 0, 0, {0, 0, 255}, 1);
}

TEST(DecodeImage, ValuesBeyondTheLimitedRangeAreClamped) {
  const Image8 image = decoded(raw({PixelLayout::yuyv}, 2, 1), {0, 128, 255, 128});
  expect_rgb(image, 0, 0, {0, 0, 0});
  expect_rgb(image, 1, 0, {255, 255, 255});
}

TEST(DecodeImage, TwoPixelsShareTheirChromaAndKeepTheirLuma) {
  const Image8 image =
      decoded(raw({PixelLayout::yuyv}, 4, 1), {50, 128, 60, 128, 70, 128, 80, 128});
  for (int x = 0; x < 4; ++x) {
    const int expected = static_cast<int>(std::lround((50 + 10 * x - 16) * 255.0 / 219.0));
    expect_rgb(image, x, 0, {expected, expected, expected}, 1);
  }
}

TEST(DecodeImage, OddSizesUseTheLastWholeChromaSample) {
  const Image8 packed = decoded(raw({PixelLayout::yuyv}, 3, 1), {16, 128, 16, 128, 81, 90, 0, 240});
  EXPECT_EQ(packed.width, 3);
  expect_rgb(packed, 2, 0, {255, 0, 0}, 1);
  // 3x3 NV12: luma rows of 4 bytes, two chroma rows of two pairs; the last pixel uses the last
  // pair.
  Bytes nv12(4 * 3, 81);
  nv12.insert(nv12.end(), {128, 128, 128, 128, 128, 128, 90, 240});
  expect_rgb(decoded(raw({PixelLayout::nv12}, 3, 3), nv12), 2, 2, {255, 0, 0}, 1);
}

TEST(DecodeImage, GreyLevelsStayAsTheyAre) {
  Bytes bytes(256);
  for (int level = 0; level < 256; ++level) bytes[level] = static_cast<std::uint8_t>(level);
  const Image8 image = decoded(raw({PixelLayout::grey, 8}, 16, 16), bytes);
  EXPECT_EQ(image.channels, 1);
  EXPECT_EQ(image.pixels, bytes);
}

TEST(DecodeImage, LimitedRangeGreyAndRgbAreStretched) {
  RawImageFormat format = raw({PixelLayout::grey, 8}, 3, 1);
  format.range = SampleRange::limited;
  EXPECT_EQ(decoded(format, {16, 235, 126}).pixels, (Bytes{0, 255, 128}));
  format = raw({PixelLayout::rgb}, 1, 1);
  format.range = SampleRange::limited;
  EXPECT_EQ(decoded(format, {16, 235, 126}).pixels, (Bytes{0, 255, 128}));
}

TEST(DecodeImage, DeepGreyIsLittleEndianAndScaledToTheFullRange) {
  EXPECT_EQ(decoded(raw({PixelLayout::grey, 16}, 3, 1), {0, 0, 0xff, 0xff, 0x00, 0x80}).pixels,
            (Bytes{0, 255, 128}));
  EXPECT_EQ(decoded(raw({PixelLayout::grey, 12}, 2, 1), {0xff, 0x0f, 0x00, 0x08}).pixels,
            (Bytes{255, 128}));
  EXPECT_EQ(decoded(raw({PixelLayout::grey, 10}, 2, 1), {0xff, 0x03, 0x00, 0x02}).pixels,
            (Bytes{255, 128}));
}

TEST(DecodeImage, SamplesAboveTheirMaximumAreClamped) {
  EXPECT_EQ(decoded(raw({PixelLayout::grey, 10}, 1, 1), {0xff, 0xff}).pixels, (Bytes{255}));
}

TEST(DecodeImage, LinearLightIsCodedByTheSrgbCurve) {
  RawImageFormat format = raw({PixelLayout::grey, 16}, 3, 1);
  format.linear_light = true;
  // IEC 61966-2-1: 18 % grey is level 118; the straight part at the dark end has slope 12.92.
  const auto grey = static_cast<int>(0.18 * 65535);
  const Bytes bytes{
      static_cast<std::uint8_t>(grey & 255), static_cast<std::uint8_t>(grey >> 8), 66, 0, 255, 255};
  EXPECT_EQ(decoded(format, bytes).pixels, (Bytes{118, 3, 255}));
}

TEST(DecodeImage, RgbAndBgrDifferInTheirOrderOnly) {
  const Bytes bytes{10, 20, 30, 40, 50, 60};
  EXPECT_EQ(decoded(raw({PixelLayout::rgb}, 2, 1), bytes).pixels, bytes);
  EXPECT_EQ(decoded(raw({PixelLayout::bgr}, 2, 1), bytes).pixels, (Bytes{30, 20, 10, 60, 50, 40}));
}

TEST(DecodeImage, PackedBayerHoldsTheSameSamplesAsUnpacked) {
  Random random(7);
  for (const int bits : {10, 12}) {
    const int width = 9;  // not a whole number of groups
    const int height = 4;
    const RawImageFormat unpacked =
        raw({PixelLayout::bayer, bits, false, BayerOrder::grbg}, width, height, 3);
    const RawImageFormat packed =
        raw({PixelLayout::bayer, bits, true, BayerOrder::grbg}, width, height, 5);
    Bytes wide(buffer_bytes(unpacked), 0xee);
    Bytes narrow(buffer_bytes(packed), 0);
    const int group = bits == 10 ? 4 : 2;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto sample = static_cast<unsigned>(random.below(1U << bits));
        wide[y * unpacked.stride_bytes + 2 * x] = static_cast<std::uint8_t>(sample & 255);
        wide[y * unpacked.stride_bytes + 2 * x + 1] = static_cast<std::uint8_t>(sample >> 8);
        // MIPI CSI-2: high bytes first, then the low bits, first pixel in the lowest.
        const std::size_t at = y * packed.stride_bytes + x / group * (group + 1);
        narrow[at + x % group] = static_cast<std::uint8_t>(sample >> (bits - 8));
        narrow[at + group] = static_cast<std::uint8_t>(
            narrow[at + group] | (sample & ((1U << (bits - 8)) - 1)) << ((bits - 8) * (x % group)));
      }
    }
    EXPECT_EQ(decoded(unpacked, wide), decoded(packed, narrow)) << bits;
  }
}

/// Every layout of raw samples, for what all of them must do.
const std::vector<PixelFormat> kRawFormats{{PixelLayout::grey, 8},
                                           {PixelLayout::grey, 16},
                                           {PixelLayout::yuyv},
                                           {PixelLayout::uyvy},
                                           {PixelLayout::nv12},
                                           {PixelLayout::nv21},
                                           {PixelLayout::rgb},
                                           {PixelLayout::bgr},
                                           {PixelLayout::bayer, 8},
                                           {PixelLayout::bayer, 10},
                                           {PixelLayout::bayer, 10, true},
                                           {PixelLayout::bayer, 12, true},
                                           {PixelLayout::bayer, 16}};

TEST(DecodeImage, StrideIsHonouredAndPaddingNeverSeen) {
  Random random(3);
  for (const PixelFormat& pixels : kRawFormats) {
    const RawImageFormat tight = raw(pixels, 7, 5);
    const RawImageFormat wide = raw(pixels, 7, 5, 61);
    Bytes tight_bytes(buffer_bytes(tight));
    Bytes wide_bytes(buffer_bytes(wide));
    for (std::uint8_t& byte : tight_bytes) byte = static_cast<std::uint8_t>(random.below(256));
    for (std::uint8_t& byte : wide_bytes) byte = static_cast<std::uint8_t>(random.below(256));
    for (std::size_t row = 0; row * tight.stride_bytes < tight_bytes.size(); ++row) {
      std::copy_n(tight_bytes.begin() + static_cast<std::ptrdiff_t>(row * tight.stride_bytes),
                  tight.stride_bytes,
                  wide_bytes.begin() + static_cast<std::ptrdiff_t>(row * wide.stride_bytes));
    }
    EXPECT_EQ(decoded(tight, tight_bytes), decoded(wide, wide_bytes));
  }
}

TEST(DecodeImage, EveryShortBufferIsAnErrorThatCountsTheBytes) {
  for (const PixelFormat& pixels : kRawFormats) {
    const RawImageFormat format = raw(pixels, 6, 4, 2);
    for (const std::size_t missing : {std::size_t{1}, format.stride_bytes, buffer_bytes(format)}) {
      const Result<Image8> image = decode_image(format, Bytes(buffer_bytes(format) - missing));
      ASSERT_FALSE(image);
      EXPECT_EQ(image.error().kind, ErrorKind::hardware);
      EXPECT_THAT(image.error().message(), HasSubstr("cut short"));
      EXPECT_THAT(image.error().message(), HasSubstr(std::to_string(buffer_bytes(format))));
    }
  }
}

TEST(DecodeImage, AStrideShorterThanARowIsAnError) {
  for (const PixelFormat& pixels : kRawFormats) {
    RawImageFormat format = raw(pixels, 6, 4);
    format.stride_bytes -= 1;
    const Result<Image8> image = decode_image(format, Bytes(4096));
    ASSERT_FALSE(image);
    EXPECT_THAT(image.error().message(), HasSubstr("rows of"));
  }
}

TEST(DecodeImage, ImpossibleSizesAreErrors) {
  EXPECT_FALSE(decode_image(raw({PixelLayout::grey, 8}, 0, 4), Bytes(64)));
  RawImageFormat negative = raw({PixelLayout::grey, 8}, 4, 4);
  negative.height = -1;
  EXPECT_FALSE(decode_image(negative, Bytes(64)));
  EXPECT_FALSE(decode_image(raw({PixelLayout::bayer, 8}, 1, 4), Bytes(64)));
}

}  // namespace
}  // namespace skullstation
