#include "capture/scan/image_metadata.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <exiv2/exiv2.hpp>
#include <utility>

namespace skullstation {

namespace {

Exiv2::ExifData exif_of(const ImageMetadata& metadata) {
  Exiv2::ExifData exif;
  exif["Exif.Image.ImageDescription"] = metadata.description;
  exif["Exif.Image.Software"] = "Skullstation";
  if (!metadata.camera_model.empty()) exif["Exif.Image.Model"] = metadata.camera_model;
  if (!metadata.camera_serial.empty()) {
    exif["Exif.Photo.BodySerialNumber"] = metadata.camera_serial;
  }
  const auto whole = std::chrono::floor<std::chrono::seconds>(metadata.captured);
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(metadata.captured - whole).count();
  const std::string time =
      fmt::format("{:%Y:%m:%d %H:%M:%S}", fmt::gmtime(std::chrono::system_clock::to_time_t(whole)));
  exif["Exif.Image.DateTime"] = time;
  exif["Exif.Photo.DateTimeOriginal"] = time;
  exif["Exif.Photo.SubSecTimeOriginal"] = fmt::format("{:03}", ms);
  exif["Exif.Photo.OffsetTimeOriginal"] = "+00:00";
  if (metadata.exposure) {
    exif["Exif.Photo.ExposureTime"] =
        Exiv2::URational(static_cast<std::uint32_t>(metadata.exposure->count()), 1'000'000);
  }
  if (metadata.focal_length_mm) {
    exif["Exif.Photo.FocalLength"] = Exiv2::URational(
        static_cast<std::uint32_t>(std::lround(*metadata.focal_length_mm * 1000.0)), 1000);
  }
  if (metadata.focal_length_35mm) {
    exif["Exif.Photo.FocalLengthIn35mmFilm"] =
        static_cast<std::uint16_t>(std::lround(*metadata.focal_length_35mm));
  }
  return exif;
}

}  // namespace

Result<std::string> with_metadata(const std::string& image_file, const ImageMetadata& metadata) {
  try {
    auto image = Exiv2::ImageFactory::open(reinterpret_cast<const Exiv2::byte*>(image_file.data()),
                                           static_cast<long>(image_file.size()));
    image->readMetadata();
    image->setExifData(exif_of(metadata));
    image->writeMetadata();
    Exiv2::BasicIo& io = image->io();
    const Exiv2::byte* bytes = io.mmap();
    std::string written(reinterpret_cast<const char*>(bytes), io.size());
    io.munmap();
    return written;
  } catch (const std::exception& error) {
    return fail(ErrorKind::no_result, "EXIF", fmt::format("can't be written: {}", error.what()));
  }
}

}  // namespace skullstation
