#include "core/session/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "core/file.h"
#include "core/session/jpeg_file.h"

namespace skullstation {

namespace {

constexpr std::int64_t max_pixels = 1 << 30;  // OpenCV's limit for the other formats

enum class Container { png, jpeg, tiff };

std::optional<Container> container_of(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return Container::png;
  if (bytes.starts_with("\xff\xd8\xff")) return Container::jpeg;
  if (bytes.starts_with(std::string_view("II*\0", 4)) ||
      bytes.starts_with(std::string_view("MM\0*", 4))) {
    return Container::tiff;
  }
  return std::nullopt;
}

/// PNG or TIFF through OpenCV; empty if it can't be decoded whole.
Image8 decode(std::string_view bytes) {
  cv::Mat decoded;
  try {
    // imdecode reads only; its interface asks for non-const data.
    const cv::Mat data(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    decoded = cv::imdecode(data, cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return {};
  }
  if (decoded.empty() || decoded.depth() != CV_8U) return {};
  if (decoded.channels() == 3) cv::cvtColor(decoded, decoded, cv::COLOR_BGR2RGB);
  if (decoded.channels() != 1 && decoded.channels() != 3) return {};
  Image8 image(decoded.cols, decoded.rows, decoded.channels());
  const std::size_t row_bytes = decoded.cols * decoded.elemSize();
  for (int y = 0; y < decoded.rows; ++y) std::copy_n(decoded.ptr(y), row_bytes, image.row(y));
  return image;
}

std::string encode(const Image8& image, const char* extension, const std::vector<int>& options) {
  // imencode reads only; a header over const pixels has to be made from a non-const pointer.
  cv::Mat pixels(image.height, image.width, CV_8UC(image.channels),
                 const_cast<std::uint8_t*>(image.pixels.data()));
  cv::Mat bgr;
  if (image.channels == 3) {
    cv::cvtColor(pixels, bgr, cv::COLOR_RGB2BGR);
  } else {
    bgr = pixels;
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, bgr, bytes, options);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

Result<Image8> read_image(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_file(path);
  if (!bytes) return forward(bytes);
  return decode_image(*bytes, path.string());
}

Result<Image8> decode_image(std::string_view bytes, std::string_view name) {
  const std::optional<Container> container = container_of(bytes);
  if (!container) {
    return fail(
        ErrorKind::bad_input, std::string(name),
        bytes.empty() ? "is empty; an image was expected" : "is not a PNG, JPEG or TIFF image");
  }
  if (*container == Container::jpeg) return decode_jpeg_file(bytes, name, max_pixels);
  Image8 image = decode(bytes);
  if (image.empty()) {
    return fail(ErrorKind::bad_input, std::string(name),
                fmt::format("is a damaged or truncated {} image, or one of a kind that can't be "
                            "read",
                            *container == Container::png ? "PNG" : "TIFF"),
                "copy it again from where it came");
  }
  return image;
}

std::string encode_png(const Image8& image) {
  // Level 1 takes a third of the default's time for a few per cent more bytes: a scan waits for it.
  return encode(image, ".png", {cv::IMWRITE_PNG_COMPRESSION, 1});
}

std::string encode_jpeg(const Image8& image, int quality) {
  return encode(image, ".jpg", {cv::IMWRITE_JPEG_QUALITY, quality});
}

}  // namespace skullstation
