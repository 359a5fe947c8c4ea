#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/image.h"
#include "core/result.h"

namespace skullstation {

enum class PixelLayout { grey, yuyv, uyvy, nv12, nv21, rgb, bgr, bayer, jpeg };

/// Colours of the mosaic's top-left 2x2 pixels, row by row.
enum class BayerOrder { rggb, grbg, gbrg, bggr };

/// How a camera lays its samples out in memory.
struct PixelFormat {
  PixelLayout layout = PixelLayout::grey;
  int bits = 8;         ///< per sample; above 8 (grey and Bayer only) little-endian in 16 bits
  bool packed = false;  ///< Bayer 10 and 12: MIPI CSI-2 packing, low bits gathered in extra bytes
  BayerOrder order = BayerOrder::rggb;

  bool operator==(const PixelFormat&) const = default;
};

/// Luma weights of Y'CbCr: ITU-R BT.601, BT.709, BT.2020 (non-constant luminance), SMPTE 240M.
enum class YcbcrEncoding { bt601, bt709, bt2020, smpte240m };

/// Limited: luma and RGB in 16..235, chroma in 16..240. Full: all in 0..255.
enum class SampleRange { limited, full };

/// A raw buffer as the driver described it.
struct RawImageFormat {
  PixelFormat pixels;
  int width = 0;
  int height = 0;
  std::size_t stride_bytes = 0;  ///< from one row to the next; means nothing for JPEG
  YcbcrEncoding encoding = YcbcrEncoding::bt601;
  std::optional<SampleRange> range =
      {};  ///< unset: limited for Y'CbCr, full for the rest, as in V4L2
  bool linear_light =
      false;  ///< grey and Bayer samples proportional to light: sRGB curve is applied
};

/// The V4L2 pixel format of that four-character code; nothing for one that can't be decoded here.
std::optional<PixelFormat> pixel_format_from_fourcc(std::uint32_t fourcc);

/// "YUYV"; a big-endian variant (bit 31) gets "-BE" appended; unprintable bytes become '?'.
std::string fourcc_name(std::uint32_t fourcc);

/// The code of a name of four characters ("GREY", "Y16 "; a shorter name is padded with blanks);
/// nothing for an empty or longer name.
std::optional<std::uint32_t> fourcc_from_name(std::string_view name);

/// Bytes that hold one row of samples, without padding. Zero for JPEG.
std::size_t row_bytes(const PixelFormat& format, int width);

/// Bytes that a whole buffer must have. Zero for JPEG.
std::size_t buffer_bytes(const RawImageFormat& format);

/// The picture: 1 channel for grey, 3 (RGB) for the rest; colour-subsampled layouts repeat their
/// chroma. Y'CbCr is converted by the formulas of ITU-R BT.601/709/2020 section "Quantization".
/// Errors (kind hardware): the buffer is shorter than the format says, the stride is shorter than
/// a row, a JPEG is damaged or of another size.
Result<Image8> decode_image(const RawImageFormat& format, std::span<const std::uint8_t> bytes);

}  // namespace skullstation
