#include "capture/cameras/pixel_format.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "capture/cameras/demosaic.h"
#include "core/session/jpeg_file.h"

namespace skullstation {
namespace {

struct NamedFormat {
  std::uint32_t fourcc;
  PixelFormat format;
};

constexpr PixelFormat bayer(int bits, BayerOrder order, bool packed = false) {
  return {PixelLayout::bayer, bits, packed, order};
}

constexpr auto kFormats = std::to_array<NamedFormat>({
    {V4L2_PIX_FMT_GREY, {PixelLayout::grey, 8}},
    {V4L2_PIX_FMT_Y10, {PixelLayout::grey, 10}},
    {V4L2_PIX_FMT_Y12, {PixelLayout::grey, 12}},
    {V4L2_PIX_FMT_Y16, {PixelLayout::grey, 16}},
    {V4L2_PIX_FMT_YUYV, {PixelLayout::yuyv}},
    {V4L2_PIX_FMT_UYVY, {PixelLayout::uyvy}},
    {V4L2_PIX_FMT_NV12, {PixelLayout::nv12}},
    {V4L2_PIX_FMT_NV21, {PixelLayout::nv21}},
    {V4L2_PIX_FMT_RGB24, {PixelLayout::rgb}},
    {V4L2_PIX_FMT_BGR24, {PixelLayout::bgr}},
    {V4L2_PIX_FMT_MJPEG, {PixelLayout::jpeg}},
    {V4L2_PIX_FMT_JPEG, {PixelLayout::jpeg}},
    {V4L2_PIX_FMT_SRGGB8, bayer(8, BayerOrder::rggb)},
    {V4L2_PIX_FMT_SGRBG8, bayer(8, BayerOrder::grbg)},
    {V4L2_PIX_FMT_SGBRG8, bayer(8, BayerOrder::gbrg)},
    {V4L2_PIX_FMT_SBGGR8, bayer(8, BayerOrder::bggr)},
    {V4L2_PIX_FMT_SRGGB10, bayer(10, BayerOrder::rggb)},
    {V4L2_PIX_FMT_SGRBG10, bayer(10, BayerOrder::grbg)},
    {V4L2_PIX_FMT_SGBRG10, bayer(10, BayerOrder::gbrg)},
    {V4L2_PIX_FMT_SBGGR10, bayer(10, BayerOrder::bggr)},
    {V4L2_PIX_FMT_SRGGB10P, bayer(10, BayerOrder::rggb, true)},
    {V4L2_PIX_FMT_SGRBG10P, bayer(10, BayerOrder::grbg, true)},
    {V4L2_PIX_FMT_SGBRG10P, bayer(10, BayerOrder::gbrg, true)},
    {V4L2_PIX_FMT_SBGGR10P, bayer(10, BayerOrder::bggr, true)},
    {V4L2_PIX_FMT_SRGGB12, bayer(12, BayerOrder::rggb)},
    {V4L2_PIX_FMT_SGRBG12, bayer(12, BayerOrder::grbg)},
    {V4L2_PIX_FMT_SGBRG12, bayer(12, BayerOrder::gbrg)},
    {V4L2_PIX_FMT_SBGGR12, bayer(12, BayerOrder::bggr)},
    {V4L2_PIX_FMT_SRGGB12P, bayer(12, BayerOrder::rggb, true)},
    {V4L2_PIX_FMT_SGRBG12P, bayer(12, BayerOrder::grbg, true)},
    {V4L2_PIX_FMT_SGBRG12P, bayer(12, BayerOrder::gbrg, true)},
    {V4L2_PIX_FMT_SBGGR12P, bayer(12, BayerOrder::bggr, true)},
    {V4L2_PIX_FMT_SRGGB16, bayer(16, BayerOrder::rggb)},
    {V4L2_PIX_FMT_SGRBG16, bayer(16, BayerOrder::grbg)},
    {V4L2_PIX_FMT_SGBRG16, bayer(16, BayerOrder::gbrg)},
    {V4L2_PIX_FMT_SBGGR16, bayer(16, BayerOrder::bggr)},
});

constexpr std::uint32_t kBigEndian = 1U << 31;

std::uint8_t clamped(int level) { return static_cast<std::uint8_t>(std::clamp(level, 0, 255)); }

/// A limited-range RGB or grey level stretched to the full range.
std::array<std::uint8_t, 256> range_table(SampleRange range) {
  std::array<std::uint8_t, 256> table{};
  for (int level = 0; level < 256; ++level) {
    table[level] = range == SampleRange::full
                       ? clamped(level)
                       : clamped(static_cast<int>(std::lround((level - 16) * 255.0 / 219.0)));
  }
  return table;
}

/// 8-bit level of each raw sample; light is coded by the sRGB curve (IEC 61966-2-1).
std::vector<std::uint8_t> sample_table(int bits, bool linear_light) {
  const int maximum = (1 << bits) - 1;
  std::vector<std::uint8_t> table(static_cast<std::size_t>(maximum) + 1);
  for (int sample = 0; sample <= maximum; ++sample) {
    double level = static_cast<double>(sample) / maximum;
    if (linear_light) {
      level = level <= 0.0031308 ? 12.92 * level : 1.055 * std::pow(level, 1.0 / 2.4) - 0.055;
    }
    table[sample] = clamped(static_cast<int>(std::lround(255.0 * level)));
  }
  return table;
}

/// Y'CbCr to R'G'B' in 16.16 fixed point, so that every machine gives the same bytes.
class YcbcrMatrix {
 public:
  YcbcrMatrix(YcbcrEncoding encoding, SampleRange range) {
    const auto [kr, kb] = luma_weights(encoding);
    const double kg = 1.0 - kr - kb;
    const double luma_gain = range == SampleRange::limited ? 255.0 / 219.0 : 1.0;
    const double chroma_gain = range == SampleRange::limited ? 255.0 / 224.0 : 1.0;
    black_ = range == SampleRange::limited ? 16 : 0;
    luma_ = fixed(luma_gain);
    red_cr_ = fixed(2.0 * (1.0 - kr) * chroma_gain);
    blue_cb_ = fixed(2.0 * (1.0 - kb) * chroma_gain);
    green_cr_ = fixed(2.0 * kr * (1.0 - kr) / kg * chroma_gain);
    green_cb_ = fixed(2.0 * kb * (1.0 - kb) / kg * chroma_gain);
  }

  void convert(int y, int cb, int cr, std::uint8_t* rgb) const {
    const int light = luma_ * (y - black_) + kHalf;
    const int blue = cb - 128;
    const int red = cr - 128;
    rgb[0] = clamped((light + red_cr_ * red) >> 16);
    rgb[1] = clamped((light - green_cr_ * red - green_cb_ * blue) >> 16);
    rgb[2] = clamped((light + blue_cb_ * blue) >> 16);
  }

 private:
  static constexpr int kHalf = 1 << 15;

  static int fixed(double value) { return static_cast<int>(std::lround(value * 65536.0)); }

  static std::pair<double, double> luma_weights(YcbcrEncoding encoding) {
    switch (encoding) {
      case YcbcrEncoding::bt601: break;
      case YcbcrEncoding::bt709: return {0.2126, 0.0722};
      case YcbcrEncoding::bt2020: return {0.2627, 0.0593};
      case YcbcrEncoding::smpte240m: return {0.212, 0.087};
    }
    return {0.299, 0.114};
  }

  int black_, luma_, red_cr_, blue_cb_, green_cr_, green_cb_;
};

Image8 decode_packed_422(const RawImageFormat& format, const std::uint8_t* bytes) {
  const YcbcrMatrix matrix(format.encoding, format.range.value_or(SampleRange::limited));
  const int luma = format.pixels.layout == PixelLayout::yuyv ? 0 : 1;
  const int chroma = 1 - luma;
  Image8 image(format.width, format.height, 3);
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* from = bytes + y * format.stride_bytes;
    std::uint8_t* to = image.row(y);
    for (int x = 0; x < format.width; ++x, to += 3) {
      const std::uint8_t* pair = from + std::ptrdiff_t{4} * (x / 2);
      matrix.convert(pair[2 * (x & 1) + luma], pair[chroma], pair[chroma + 2], to);
    }
  }
  return image;
}

Image8 decode_semi_planar_420(const RawImageFormat& format, const std::uint8_t* bytes) {
  const YcbcrMatrix matrix(format.encoding, format.range.value_or(SampleRange::limited));
  const int cb = format.pixels.layout == PixelLayout::nv12 ? 0 : 1;
  const std::uint8_t* chroma_plane = bytes + format.stride_bytes * format.height;
  Image8 image(format.width, format.height, 3);
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* luma = bytes + y * format.stride_bytes;
    const std::uint8_t* chroma = chroma_plane + (y / 2) * format.stride_bytes;
    std::uint8_t* to = image.row(y);
    for (int x = 0; x < format.width; ++x, to += 3) {
      const std::uint8_t* pair = chroma + std::ptrdiff_t{2} * (x / 2);
      matrix.convert(luma[x], pair[cb], pair[1 - cb], to);
    }
  }
  return image;
}

Image8 decode_rgb(const RawImageFormat& format, const std::uint8_t* bytes) {
  const auto table = range_table(format.range.value_or(SampleRange::full));
  const int red = format.pixels.layout == PixelLayout::rgb ? 0 : 2;
  Image8 image(format.width, format.height, 3);
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* from = bytes + y * format.stride_bytes;
    std::uint8_t* to = image.row(y);
    for (int x = 0; x < format.width; ++x, from += 3, to += 3) {
      to[0] = table[from[red]];
      to[1] = table[from[1]];
      to[2] = table[from[2 - red]];
    }
  }
  return image;
}

/// Sample `x` of a row of MIPI CSI-2 packed pixels: groups of 4 (10 bits) or 2 (12 bits), first
/// their high bytes, then one byte with their low bits, those of the first pixel lowest.
int packed_sample(const std::uint8_t* row, int x, int bits) {
  const int group = bits == 10 ? 4 : 2;
  const int low_bits = bits - 8;
  const std::uint8_t* packed = row + std::ptrdiff_t{x / group} * (group + 1);
  const int low = packed[group] >> (low_bits * (x % group)) & ((1 << low_bits) - 1);
  return packed[x % group] << low_bits | low;
}

/// One channel of raw samples, unpacked; values above the format's maximum are clamped to it.
Image16 unpack_samples(const RawImageFormat& format, const std::uint8_t* bytes) {
  const int bits = format.pixels.bits;
  const int maximum = (1 << bits) - 1;
  Image16 samples(format.width, format.height, 1);
  for (int y = 0; y < format.height; ++y) {
    const std::uint8_t* from = bytes + y * format.stride_bytes;
    std::uint16_t* to = samples.row(y);
    for (int x = 0; x < format.width; ++x) {
      if (bits == 8) {
        to[x] = from[x];
      } else if (format.pixels.packed) {
        to[x] = static_cast<std::uint16_t>(packed_sample(from, x, bits));
      } else {
        const std::uint8_t* pair = from + std::ptrdiff_t{2} * x;
        to[x] = static_cast<std::uint16_t>(std::min(pair[0] | pair[1] << 8, maximum));
      }
    }
  }
  return samples;
}

Image8 to_8_bits(const Image16& samples, const std::vector<std::uint8_t>& table) {
  Image8 image(samples.width, samples.height, samples.channels);
  std::transform(samples.pixels.begin(), samples.pixels.end(), image.pixels.begin(),
                 [&table](std::uint16_t sample) { return table[sample]; });
  return image;
}

Image8 decode_grey(const RawImageFormat& format, const std::uint8_t* bytes) {
  Image8 image = to_8_bits(unpack_samples(format, bytes),
                           sample_table(format.pixels.bits, format.linear_light));
  const auto table = range_table(format.range.value_or(SampleRange::full));
  for (std::uint8_t& level : image.pixels) level = table[level];
  return image;
}

Image8 decode_bayer(const RawImageFormat& format, const std::uint8_t* bytes) {
  const int maximum = (1 << format.pixels.bits) - 1;
  return to_8_bits(demosaic(unpack_samples(format, bytes), format.pixels.order, maximum),
                   sample_table(format.pixels.bits, format.linear_light));
}

/// A picture of a Motion-JPEG stream. It may leave the standard Huffman tables out and carry
/// padding behind its end: libjpeg-turbo supplies the former and ignores the latter.
Result<Image8> decode_jpeg(const RawImageFormat& format, std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  Result<Image8> image =
      decode_jpeg_file(text, "picture", std::int64_t{format.width} * format.height);
  if (!image) return fail(ErrorKind::hardware, image.error().where, image.error().what);
  if (image->width != format.width || image->height != format.height) {
    return fail(ErrorKind::hardware, "picture",
                fmt::format("is {}x{}, expected {}x{}", image->width, image->height, format.width,
                            format.height));
  }
  return image;
}

}  // namespace

std::optional<PixelFormat> pixel_format_from_fourcc(std::uint32_t fourcc) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(),
                                   [fourcc](const auto& named) { return named.fourcc == fourcc; });
  if (found == kFormats.end()) return std::nullopt;
  return found->format;
}

std::string fourcc_name(std::uint32_t fourcc) {
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const auto letter = static_cast<char>((fourcc & ~kBigEndian) >> (8 * i));
    name += letter >= ' ' && letter <= '~' ? letter : '?';
  }
  while (!name.empty() && name.back() == ' ') name.pop_back();
  return (fourcc & kBigEndian) != 0 ? name + "-BE" : name;
}

std::optional<std::uint32_t> fourcc_from_name(std::string_view name) {
  if (name.empty() || name.size() > 4) return std::nullopt;
  std::uint32_t fourcc = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const char letter = i < name.size() ? name[i] : ' ';
    fourcc |= static_cast<std::uint32_t>(static_cast<unsigned char>(letter)) << (8 * i);
  }
  return fourcc;
}

std::size_t row_bytes(const PixelFormat& format, int width) {
  const auto pixels = static_cast<std::size_t>(width);
  switch (format.layout) {
    case PixelLayout::yuyv:
    case PixelLayout::uyvy: return (pixels + 1) / 2 * 4;
    case PixelLayout::nv12:
    case PixelLayout::nv21: return (pixels + 1) / 2 * 2;
    case PixelLayout::rgb:
    case PixelLayout::bgr: return pixels * 3;
    case PixelLayout::jpeg: return 0;
    case PixelLayout::grey:
    case PixelLayout::bayer: break;
  }
  if (format.bits == 8) return pixels;
  if (!format.packed) return pixels * 2;
  return format.bits == 10 ? (pixels + 3) / 4 * 5 : (pixels + 1) / 2 * 3;
}

std::size_t buffer_bytes(const RawImageFormat& format) {
  const auto rows = static_cast<std::size_t>(format.height);
  switch (format.pixels.layout) {
    case PixelLayout::jpeg: return 0;
    case PixelLayout::nv12:
    case PixelLayout::nv21: return format.stride_bytes * (rows + (rows + 1) / 2);
    default: return format.stride_bytes * rows;
  }
}

Result<Image8> decode_image(const RawImageFormat& format, std::span<const std::uint8_t> bytes) {
  const PixelFormat& pixels = format.pixels;
  if (format.width <= 0 || format.height <= 0) {
    return fail(ErrorKind::hardware, "picture",
                fmt::format("has no pixels ({}x{})", format.width, format.height));
  }
  if (pixels.layout == PixelLayout::jpeg) return decode_jpeg(format, bytes);
  if (format.stride_bytes < row_bytes(pixels, format.width)) {
    return fail(ErrorKind::hardware, "picture",
                fmt::format("has rows of {} bytes, {} pixels need {}", format.stride_bytes,
                            format.width, row_bytes(pixels, format.width)));
  }
  if (bytes.size() < buffer_bytes(format)) {
    return fail(ErrorKind::hardware, "picture",
                fmt::format("is cut short: {} of {} bytes", bytes.size(), buffer_bytes(format)));
  }
  switch (pixels.layout) {
    case PixelLayout::yuyv:
    case PixelLayout::uyvy: return decode_packed_422(format, bytes.data());
    case PixelLayout::nv12:
    case PixelLayout::nv21: return decode_semi_planar_420(format, bytes.data());
    case PixelLayout::rgb:
    case PixelLayout::bgr: return decode_rgb(format, bytes.data());
    case PixelLayout::grey: return decode_grey(format, bytes.data());
    default: break;
  }
  if (format.width < 2 || format.height < 2) {
    return fail(
        ErrorKind::hardware, "picture",
        fmt::format("is {}x{}, too small for a Bayer pattern", format.width, format.height));
  }
  return decode_bayer(format, bytes.data());
}

}  // namespace skullstation
