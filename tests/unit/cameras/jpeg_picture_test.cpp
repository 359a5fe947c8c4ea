// The pictures of Motion-JPEG streams, whole and damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "capture/cameras/pixel_format.h"
#include "core/random.h"
#include "core/session/image_file.h"

namespace skullstation {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::HasSubstr;

Image8 decoded(const RawImageFormat& format, const Bytes& bytes) {
  Result<Image8> image = decode_image(format, bytes);
  if (!image) {
    ADD_FAILURE() << image.error().message();
    return Image8(format.width, format.height, 3);
  }
  return std::move(*image);
}

Image8 test_picture(int channels) {
  Image8 image(48, 32, channels);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < channels; ++c)
        image.at(x, y, c) = static_cast<std::uint8_t>(20 + 3 * x + 2 * y + 10 * c);
    }
  }
  return image;
}

Bytes jpeg_of(const Image8& image) {
  const std::string text = encode_jpeg(image, 95);
  return {text.begin(), text.end()};
}

RawImageFormat jpeg_format(int width = 48, int height = 32) {
  return {.pixels = {PixelLayout::jpeg}, .width = width, .height = height};
}

TEST(DecodeJpeg, ColourAndGreyComeBack) {
  for (const int channels : {1, 3}) {
    const Image8 original = test_picture(channels);
    const Image8 image = decoded(jpeg_format(), jpeg_of(original));
    ASSERT_EQ(image.channels, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      EXPECT_NEAR(image.pixels[i], original.pixels[i], 6);
  }
}

/// The position of a marker segment (0xFF, `marker`), or of the end.
std::size_t find_marker(const Bytes& bytes, std::uint8_t marker, std::size_t from = 0) {
  for (std::size_t i = from; i + 1 < bytes.size(); ++i) {
    if (bytes[i] == 0xff && bytes[i + 1] == marker) return i;
  }
  return bytes.size();
}

TEST(DecodeJpeg, StandardHuffmanTablesMayBeLeftOutAsCamerasDo) {
  const Bytes whole = jpeg_of(test_picture(3));
  Bytes bare = whole;
  int removed = 0;
  for (std::size_t at = find_marker(bare, 0xc4); at < bare.size(); at = find_marker(bare, 0xc4)) {
    const std::size_t length = 2 + static_cast<std::size_t>(bare[at + 2] << 8 | bare[at + 3]);
    bare.erase(bare.begin() + static_cast<std::ptrdiff_t>(at),
               bare.begin() + static_cast<std::ptrdiff_t>(at + length));
    ++removed;
  }
  ASSERT_GT(removed, 0);
  EXPECT_EQ(decoded(jpeg_format(), bare), decoded(jpeg_format(), whole));
}

TEST(DecodeJpeg, PaddingBehindAndAStrayByteBeforeTheEndDoNoHarm) {
  const Bytes whole = jpeg_of(test_picture(3));
  Bytes padded = whole;
  padded.insert(padded.end(), 100, 0);
  EXPECT_EQ(decoded(jpeg_format(), padded), decoded(jpeg_format(), whole));
  Bytes stray = whole;
  stray.insert(stray.end() - 2, 0x00);
  EXPECT_EQ(decoded(jpeg_format(), stray), decoded(jpeg_format(), whole));
}

TEST(DecodeJpeg, ATruncationAtAnyPointIsAnError) {
  const Bytes whole = jpeg_of(test_picture(3));
  for (std::size_t length = 0; length + 3 < whole.size(); ++length) {
    const Result<Image8> image = decode_image(jpeg_format(), std::span(whole).first(length));
    ASSERT_FALSE(image) << length << " of " << whole.size();
    EXPECT_EQ(image.error().kind, ErrorKind::hardware);
  }
}

TEST(DecodeJpeg, DamageIsAnErrorOrAtLeastNeverACrash) {
  const Bytes whole = jpeg_of(test_picture(3));
  Bytes lost = whole;  // a packet lost in the middle of the entropy-coded data
  lost.erase(lost.end() - 60, lost.end() - 20);
  EXPECT_FALSE(decode_image(jpeg_format(), lost));
  Random random(11);
  for (int i = 0; i < 300; ++i) {
    Bytes damaged = whole;
    for (int k = 0; k < 4; ++k)
      damaged[random.below(damaged.size())] = static_cast<std::uint8_t>(random.below(256));
    const Result<Image8> image = decode_image(jpeg_format(), damaged);
    if (image) {
      EXPECT_EQ(image->width, 48);
      EXPECT_EQ(image->height, 32);
    } else {
      EXPECT_EQ(image.error().kind, ErrorKind::hardware);
    }
  }
}

TEST(DecodeJpeg, AnotherSizeOrSomethingElseIsAnError) {
  const Result<Image8> other = decode_image(jpeg_format(48, 33), jpeg_of(test_picture(3)));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message(), HasSubstr("48x32"));
  EXPECT_THAT(other.error().message(), HasSubstr("48x33"));
  EXPECT_FALSE(decode_image(jpeg_format(), Bytes(500, 0x42)));
  EXPECT_FALSE(decode_image(jpeg_format(), Bytes{}));
}

}  // namespace
}  // namespace skullstation
