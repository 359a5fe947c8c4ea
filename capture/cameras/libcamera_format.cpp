#include "capture/cameras/libcamera_format.h"

#include <libcamera/formats.h>

#include <algorithm>
#include <array>
#include <utility>

namespace skullstation {
namespace {

namespace formats = libcamera::formats;

constexpr PixelFormat bayer(int bits, BayerOrder order, bool packed = false) {
  return {PixelLayout::bayer, bits, packed, order};
}

/// The better the format, the earlier.
const auto kFormats = std::to_array<std::pair<libcamera::PixelFormat, PixelFormat>>({
    {formats::BGR888, {PixelLayout::rgb}},
    {formats::RGB888, {PixelLayout::bgr}},
    {formats::YUYV, {PixelLayout::yuyv}},
    {formats::UYVY, {PixelLayout::uyvy}},
    {formats::NV12, {PixelLayout::nv12}},
    {formats::NV21, {PixelLayout::nv21}},
    {formats::MJPEG, {PixelLayout::jpeg}},
    {formats::SRGGB16, bayer(16, BayerOrder::rggb)},
    {formats::SGRBG16, bayer(16, BayerOrder::grbg)},
    {formats::SGBRG16, bayer(16, BayerOrder::gbrg)},
    {formats::SBGGR16, bayer(16, BayerOrder::bggr)},
    {formats::SRGGB12, bayer(12, BayerOrder::rggb)},
    {formats::SGRBG12, bayer(12, BayerOrder::grbg)},
    {formats::SGBRG12, bayer(12, BayerOrder::gbrg)},
    {formats::SBGGR12, bayer(12, BayerOrder::bggr)},
    {formats::SRGGB12_CSI2P, bayer(12, BayerOrder::rggb, true)},
    {formats::SGRBG12_CSI2P, bayer(12, BayerOrder::grbg, true)},
    {formats::SGBRG12_CSI2P, bayer(12, BayerOrder::gbrg, true)},
    {formats::SBGGR12_CSI2P, bayer(12, BayerOrder::bggr, true)},
    {formats::SRGGB10, bayer(10, BayerOrder::rggb)},
    {formats::SGRBG10, bayer(10, BayerOrder::grbg)},
    {formats::SGBRG10, bayer(10, BayerOrder::gbrg)},
    {formats::SBGGR10, bayer(10, BayerOrder::bggr)},
    {formats::SRGGB10_CSI2P, bayer(10, BayerOrder::rggb, true)},
    {formats::SGRBG10_CSI2P, bayer(10, BayerOrder::grbg, true)},
    {formats::SGBRG10_CSI2P, bayer(10, BayerOrder::gbrg, true)},
    {formats::SBGGR10_CSI2P, bayer(10, BayerOrder::bggr, true)},
    {formats::SRGGB8, bayer(8, BayerOrder::rggb)},
    {formats::SGRBG8, bayer(8, BayerOrder::grbg)},
    {formats::SGBRG8, bayer(8, BayerOrder::gbrg)},
    {formats::SBGGR8, bayer(8, BayerOrder::bggr)},
    {formats::R12, {PixelLayout::grey, 12}},
    {formats::R10, {PixelLayout::grey, 10}},
    {formats::R8, {PixelLayout::grey, 8}},
});

}  // namespace

std::optional<PixelFormat> pixel_format_from_libcamera(const libcamera::PixelFormat& format) {
  for (const auto& [theirs, ours] : kFormats) {
    if (theirs == format) return ours;
  }
  return std::nullopt;
}

std::optional<libcamera::PixelFormat> best_libcamera_format(
    const std::vector<libcamera::PixelFormat>& offered) {
  for (const auto& [theirs, ours] : kFormats) {
    if (std::find(offered.begin(), offered.end(), theirs) != offered.end()) return theirs;
  }
  return std::nullopt;
}

RawImageFormat image_format(const libcamera::StreamConfiguration& stream) {
  RawImageFormat image;
  image.pixels = *pixel_format_from_libcamera(stream.pixelFormat);
  image.width = static_cast<int>(stream.size.width);
  image.height = static_cast<int>(stream.size.height);
  image.stride_bytes = stream.stride != 0 ? stream.stride : row_bytes(image.pixels, image.width);
  if (!stream.colorSpace) return image;
  using libcamera::ColorSpace;
  switch (stream.colorSpace->ycbcrEncoding) {
    case ColorSpace::YcbcrEncoding::None:
    case ColorSpace::YcbcrEncoding::Rec601: break;
    case ColorSpace::YcbcrEncoding::Rec709: image.encoding = YcbcrEncoding::bt709; break;
    case ColorSpace::YcbcrEncoding::Rec2020: image.encoding = YcbcrEncoding::bt2020; break;
  }
  image.range = stream.colorSpace->range == ColorSpace::Range::Full ? SampleRange::full
                                                                    : SampleRange::limited;
  image.linear_light = stream.colorSpace->transferFunction == ColorSpace::TransferFunction::Linear;
  return image;
}

}  // namespace skullstation
