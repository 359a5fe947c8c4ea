#include "capture/scan/image_metadata.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <exiv2/exiv2.hpp>

#include "core/session/image_file.h"

namespace skullstation {
namespace {

Exiv2::ExifData exif_in(const std::string& file) {
  auto image = Exiv2::ImageFactory::open(reinterpret_cast<const Exiv2::byte*>(file.data()),
                                         static_cast<long>(file.size()));
  image->readMetadata();
  return image->exifData();
}

ImageMetadata full_metadata() {
  ImageMetadata metadata;
  metadata.description = "case 2026-0042, pass 1, camera cam0, table at 7.5000 deg";
  metadata.camera_model = "HD Pro Webcam C920";
  metadata.camera_serial = "5A2E";
  metadata.captured = UtcTime{std::chrono::milliseconds{1767225600250}};
  metadata.exposure = std::chrono::microseconds(8001);
  metadata.focal_length_mm = 3.67;
  metadata.focal_length_35mm = 27.8;
  return metadata;
}

TEST(ImageMetadata, IsReadBackFromPngAndJpegWithTheSamePixels) {
  Image8 image(32, 24, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = static_cast<std::uint8_t>(i);
  }
  for (const std::string& plain : {encode_png(image), encode_jpeg(image, 90)}) {
    const Result<std::string> file = with_metadata(plain, full_metadata());
    ASSERT_TRUE(file) << file.error().message();
    EXPECT_EQ(*decode_image(*file, "with"), *decode_image(plain, "without"));
    Exiv2::ExifData exif = exif_in(*file);
    EXPECT_EQ(exif["Exif.Image.ImageDescription"].toString(), full_metadata().description);
    EXPECT_EQ(exif["Exif.Image.Model"].toString(), "HD Pro Webcam C920");
    EXPECT_EQ(exif["Exif.Photo.BodySerialNumber"].toString(), "5A2E");
    EXPECT_EQ(exif["Exif.Photo.DateTimeOriginal"].toString(), "2026:01:01 00:00:00");
    EXPECT_EQ(exif["Exif.Photo.SubSecTimeOriginal"].toString(), "250");
    EXPECT_EQ(exif["Exif.Photo.OffsetTimeOriginal"].toString(), "+00:00");
    EXPECT_EQ(exif["Exif.Photo.ExposureTime"].toString(), "8001/1000000");
    EXPECT_EQ(exif["Exif.Photo.FocalLength"].toString(), "3670/1000");
    EXPECT_EQ(exif["Exif.Photo.FocalLengthIn35mmFilm"].toString(), "28");
  }
}

TEST(ImageMetadata, LeavesOutWhatIsUnknown) {
  ImageMetadata metadata;
  metadata.captured = UtcTime{std::chrono::seconds{1767225600}};
  const Result<std::string> file = with_metadata(encode_png(Image8(4, 4, 1)), metadata);
  ASSERT_TRUE(file) << file.error().message();
  const Exiv2::ExifData exif = exif_in(*file);
  for (const char* key : {"Exif.Image.Model", "Exif.Photo.ExposureTime", "Exif.Photo.FocalLength",
                          "Exif.Photo.FocalLengthIn35mmFilm", "Exif.Photo.BodySerialNumber"}) {
    EXPECT_EQ(exif.findKey(Exiv2::ExifKey(key)), exif.end()) << key;
  }
}

TEST(ImageMetadata, OfNoImageIsAnError) {
  const Result<std::string> file = with_metadata("no image", full_metadata());
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message(), ::testing::HasSubstr("EXIF: can't be written"));
}

}  // namespace
}  // namespace skullstation
