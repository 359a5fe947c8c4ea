#include "core/session/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

/// Smooth, with different channels, so that JPEG keeps it and mixed-up channels show.
Image8 gradient(int width, int height, int channels) {
  Image8 image(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        image.at(x, y, c) = static_cast<std::uint8_t>((c == 0   ? x * 255 / width
                                                       : c == 1 ? y * 255 / height
                                                                : 200));
      }
    }
  }
  return image;
}

double greatest_difference(const Image8& a, const Image8& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) return 1e9;
  int greatest = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    greatest = std::max(greatest, std::abs(a.pixels[i] - b.pixels[i]));
  }
  return greatest;
}

std::string encoded_by_opencv(const char* extension, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(ImageFile, PngKeepsEveryPixel) {
  for (const int channels : {1, 3}) {
    const Image8 image = gradient(37, 21, channels);
    const Result<Image8> read = decode_image(encode_png(image), "a.png");
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(*read, image);
  }
}

TEST(ImageFile, JpegKeepsChannelsAndNearlyTheirValues) {
  for (const int channels : {1, 3}) {
    const Image8 image = gradient(64, 48, channels);
    const Result<Image8> read = decode_image(encode_jpeg(image, 95), "a.jpg");
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_LT(greatest_difference(*read, image), 12.0);
  }
}

TEST(ImageFile, TiffIsRead) {
  const cv::Mat red(5, 7, CV_8UC3, cv::Scalar(0, 0, 255));  // OpenCV's order: blue first
  const Result<Image8> read = decode_image(encoded_by_opencv(".tiff", red), "a.tif");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->channels, 3);
  EXPECT_EQ(read->at(3, 2, 0), 255);
  EXPECT_EQ(read->at(3, 2, 2), 0);
}

TEST(ImageFile, SixteenBitsBecomeEightAndTransparencyIsDropped) {
  const Result<Image8> deep =
      decode_image(encoded_by_opencv(".png", cv::Mat(4, 4, CV_16UC1, cv::Scalar(0x8000))), "a.png");
  ASSERT_TRUE(deep) << deep.error().message();
  EXPECT_EQ(deep->channels, 1);
  EXPECT_EQ(deep->at(1, 1), 0x80);
  const Result<Image8> clear = decode_image(
      encoded_by_opencv(".png", cv::Mat(4, 4, CV_8UC4, cv::Scalar(1, 2, 3, 40))), "a.png");
  ASSERT_TRUE(clear) << clear.error().message();
  EXPECT_EQ(clear->channels, 3);
  EXPECT_EQ(clear->at(0, 0, 0), 3);
}

/// An EXIF block that says "turn by 90 degrees" must not change what pixel is where.
TEST(ImageFile, ExifOrientationDoesNotTurnTheImage) {
  const std::string exif(
      "\xff\xe1\x00\x22"
      "Exif\0\0"
      "MM\0*\0\0\0\x08"
      "\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0",
      36);
  std::string jpeg = encode_jpeg(gradient(40, 20, 3), 90);
  jpeg.insert(2, exif);
  const Result<Image8> read = decode_image(jpeg, "a.jpg");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->width, 40);
  EXPECT_EQ(read->height, 20);
}

TEST(ImageFile, TruncationAnywhereIsAnError) {
  const std::string png = encode_png(gradient(60, 40, 3));
  const std::string jpeg = encode_jpeg(gradient(60, 40, 3), 90);
  const std::string tiff =
      encoded_by_opencv(".tiff", cv::Mat(40, 60, CV_8UC3, cv::Scalar(9, 8, 7)));
  for (const std::string& file : {png, jpeg, tiff}) {
    ASSERT_TRUE(decode_image(file, "whole"));
    for (std::size_t size = 0; size + 16 < file.size(); size += 7) {
      const Result<Image8> read = decode_image(file.substr(0, size), "cut.img");
      ASSERT_FALSE(read) << size << " of " << file.size() << " bytes";
      EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
      EXPECT_EQ(read.error().where, "cut.img");
    }
  }
}

TEST(ImageFile, ALostSectorIsAnError) {
  Image8 image(400, 300, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = static_cast<std::uint8_t>(i * i * 7 >> 3);
  }
  for (std::string file : {encode_png(image), encode_jpeg(image, 90)}) {
    file.erase(file.size() / 2, 512);
    const Result<Image8> read = decode_image(file, "damaged");
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message(), HasSubstr("damaged or truncated"));
  }
}

TEST(ImageFile, StrayBytesBetweenJpegSegmentsAreHarmless) {
  std::string jpeg = encode_jpeg(gradient(40, 20, 3), 90);
  jpeg.insert(jpeg.size() - 2, std::string(3, '\x55'));
  EXPECT_TRUE(decode_image(jpeg, "a.jpg"));
}

TEST(ImageFile, ForeignAndMissingFilesAreNamed) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_image(folder / "none.png").error().message(), HasSubstr("none.png"));
  ASSERT_TRUE(write_file_durably(folder / "text.png", "no image at all"));
  EXPECT_THAT(read_image(folder / "text.png").error().message(),
              HasSubstr("is not a PNG, JPEG or TIFF image"));
  ASSERT_TRUE(write_file_durably(folder / "empty.png", ""));
  EXPECT_THAT(read_image(folder / "empty.png").error().message(), HasSubstr("is empty"));
  ASSERT_TRUE(write_file_durably(folder / "good.png", encode_png(gradient(3, 2, 1))));
  EXPECT_EQ(*read_image(folder / "good.png"), gradient(3, 2, 1));
}

}  // namespace
}  // namespace skullstation
