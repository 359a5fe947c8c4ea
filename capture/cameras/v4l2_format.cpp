#include "capture/cameras/v4l2_format.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <tuple>

namespace skullstation {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
/// Stops an enumeration that a broken driver never ends.
constexpr std::uint32_t kMostEntries = 1024;

FrameSize frame_size(std::uint32_t width, std::uint32_t height) {
  return {static_cast<int>(width), static_cast<int>(height)};
}

std::int64_t area(const FrameSize& size) { return std::int64_t{size.width} * size.height; }

void enumerate_sizes(const V4l2Device& device, V4l2OfferedFormat& format) {
  for (std::uint32_t index = 0; index < kMostEntries; ++index) {
    v4l2_frmsizeenum size{};
    size.index = index;
    size.pixel_format = format.fourcc;
    if (device.ioctl(VIDIOC_ENUM_FRAMESIZES, &size) < 0) return;  // the end, or not told
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      format.sizes.push_back(frame_size(size.discrete.width, size.discrete.height));
    } else {
      format.sizes = {frame_size(size.stepwise.max_width, size.stepwise.max_height)};
      format.smallest = frame_size(size.stepwise.min_width, size.stepwise.min_height);
      return;
    }
  }
}

bool offers_size(const V4l2OfferedFormat& format, const FrameSize& wanted) {
  if (format.smallest) {
    const FrameSize& largest = format.sizes.front();
    return wanted.width >= format.smallest->width && wanted.height >= format.smallest->height &&
           wanted.width <= largest.width && wanted.height <= largest.height;
  }
  return std::find(format.sizes.begin(), format.sizes.end(), wanted) != format.sizes.end();
}

std::optional<nanoseconds> interval_of(const v4l2_fract& fraction) {
  if (fraction.numerator == 0 || fraction.denominator == 0) return std::nullopt;
  return nanoseconds{std::int64_t{1'000'000'000} * fraction.numerator / fraction.denominator};
}

/// Does this format in this size come as often as asked? Unknown counts as yes.
bool offers_rate(const V4l2Device& device, std::uint32_t fourcc, const FrameSize& size,
                 double frames_per_second) {
  const nanoseconds wanted{std::llround(1.001e9 / frames_per_second)};
  for (std::uint32_t index = 0; index < kMostEntries; ++index) {
    v4l2_frmivalenum entry{};
    entry.index = index;
    entry.pixel_format = fourcc;
    entry.width = static_cast<std::uint32_t>(size.width);
    entry.height = static_cast<std::uint32_t>(size.height);
    if (device.ioctl(VIDIOC_ENUM_FRAMEINTERVALS, &entry) < 0) return index == 0;
    const bool discrete = entry.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const auto interval = interval_of(discrete ? entry.discrete : entry.stepwise.min);
    if (interval && *interval <= wanted) return true;
    if (!discrete) return false;
  }
  return false;
}

/// Lower is better: whole colour samples first, then subsampled, then lossy, then colours that
/// nobody has balanced, then none.
int rank(const PixelFormat& format) {
  switch (format.layout) {
    case PixelLayout::rgb:
    case PixelLayout::bgr: return 0;
    case PixelLayout::yuyv:
    case PixelLayout::uyvy: return 1;
    case PixelLayout::nv12:
    case PixelLayout::nv21: return 2;
    case PixelLayout::jpeg: return 3;
    case PixelLayout::bayer: return 4;
    case PixelLayout::grey: break;
  }
  return 5;
}

FrameSize largest_size(const V4l2OfferedFormat& format) {
  if (format.sizes.empty()) return {};
  return *std::max_element(
      format.sizes.begin(), format.sizes.end(),
      [](const FrameSize& a, const FrameSize& b) { return area(a) < area(b); });
}

struct Choice {
  std::uint32_t fourcc;
  FrameSize size;
};

tl::unexpected<Error> not_offered(const V4l2Device& device, std::string what,
                                  const std::vector<V4l2OfferedFormat>& offered) {
  return fail(ErrorKind::bad_input, device.node(), std::move(what),
              fmt::format("choose from what it offers: {}", to_string(offered)));
}

/// Why the wish can't be met, or the best match. Sizes are only compared here: whether the driver
/// takes the one asked for is seen when it is set.
Result<Choice> choose(const V4l2Device& device, const std::vector<V4l2OfferedFormat>& offered,
                      const V4l2FormatRequest& request) {
  std::optional<std::uint32_t> wanted;
  if (request.format) {
    wanted = fourcc_from_name(*request.format);
    if (!wanted || !pixel_format_from_fourcc(*wanted)) {
      return not_offered(
          device, fmt::format("pixel format \"{}\" is not one that can be read", *request.format),
          offered);
    }
  }
  using Merit = std::tuple<bool, std::int64_t, bool, int, int>;  // larger is better
  std::optional<std::pair<Merit, Choice>> best;
  for (const V4l2OfferedFormat& format : offered) {
    const auto pixels = pixel_format_from_fourcc(format.fourcc);
    if (!pixels || (wanted && *wanted != format.fourcc)) continue;
    const FrameSize size = request.size.value_or(largest_size(format));
    const bool in_size = !request.size || offers_size(format, size);
    const bool in_time = !request.frames_per_second ||
                         offers_rate(device, format.fourcc, size, *request.frames_per_second);
    const Merit merit{in_size, area(size), in_time, -rank(*pixels), pixels->bits};
    if (!best || merit > best->first) best = {merit, Choice{format.fourcc, size}};
  }
  if (!best) {
    return not_offered(device,
                       wanted
                           ? fmt::format("does not offer the pixel format {}", fourcc_name(*wanted))
                           : std::string("offers no pixel format that can be read"),
                       offered);
  }
  return best->second;
}

Result<YcbcrEncoding> ycbcr_encoding(const V4l2Device& device, const v4l2_pix_format& pixels) {
  const std::uint32_t encoding = pixels.ycbcr_enc == V4L2_YCBCR_ENC_DEFAULT
                                     ? std::uint32_t{V4L2_MAP_YCBCR_ENC_DEFAULT(pixels.colorspace)}
                                     : pixels.ycbcr_enc;
  switch (encoding) {
    case V4L2_YCBCR_ENC_601:
    case V4L2_YCBCR_ENC_XV601:
    case V4L2_YCBCR_ENC_SYCC: return YcbcrEncoding::bt601;
    case V4L2_YCBCR_ENC_709:
    case V4L2_YCBCR_ENC_XV709: return YcbcrEncoding::bt709;
    case V4L2_YCBCR_ENC_BT2020: return YcbcrEncoding::bt2020;
    case V4L2_YCBCR_ENC_SMPTE240M: return YcbcrEncoding::smpte240m;
    default:
      return fail(ErrorKind::hardware, device.node(),
                  fmt::format("uses the colour encoding {}, which can't be read", encoding),
                  "choose another pixel format");
  }
}

bool is_ycbcr(PixelLayout layout) {
  return layout == PixelLayout::yuyv || layout == PixelLayout::uyvy ||
         layout == PixelLayout::nv12 || layout == PixelLayout::nv21;
}

Result<RawImageFormat> image_format(const V4l2Device& device, const v4l2_pix_format& pixels) {
  RawImageFormat image;
  image.pixels = *pixel_format_from_fourcc(pixels.pixelformat);
  image.width = static_cast<int>(pixels.width);
  image.height = static_cast<int>(pixels.height);
  image.stride_bytes =
      pixels.bytesperline != 0 ? pixels.bytesperline : row_bytes(image.pixels, image.width);
  if (is_ycbcr(image.pixels.layout)) {
    const Result<YcbcrEncoding> encoding = ycbcr_encoding(device, pixels);
    if (!encoding) return forward(encoding);
    image.encoding = *encoding;
    const std::uint32_t range = pixels.quantization == V4L2_QUANTIZATION_DEFAULT
                                    ? std::uint32_t{V4L2_MAP_QUANTIZATION_DEFAULT(
                                          false, pixels.colorspace, pixels.ycbcr_enc)}
                                    : pixels.quantization;
    image.range = range == V4L2_QUANTIZATION_FULL_RANGE ? SampleRange::full : SampleRange::limited;
  } else if (pixels.quantization == V4L2_QUANTIZATION_LIM_RANGE) {
    image.range = SampleRange::limited;
  }
  const std::uint32_t transfer = pixels.xfer_func == V4L2_XFER_FUNC_DEFAULT
                                     ? std::uint32_t{V4L2_MAP_XFER_FUNC_DEFAULT(pixels.colorspace)}
                                     : pixels.xfer_func;
  image.linear_light = transfer == V4L2_XFER_FUNC_NONE;
  return image;
}

/// Sets the rate if one is asked for; the interval in force, if the device tells.
Result<std::optional<nanoseconds>> set_rate(const V4l2Device& device,
                                            std::optional<double> frames_per_second) {
  v4l2_streamparm parameters{};
  parameters.type = kCapture;
  auto& capture = parameters.parm.capture;
  const bool told = device.ioctl(VIDIOC_G_PARM, &parameters) >= 0;
  const bool settable = told && (capture.capability & V4L2_CAP_TIMEPERFRAME) != 0;
  if (frames_per_second) {
    if (!settable) {
      return fail(
          ErrorKind::bad_input, device.node(),
          fmt::format("its rate can't be set ({} frames per second asked)", *frames_per_second),
          "leave frames_per_second out");
    }
    capture.timeperframe = {1000,
                            static_cast<std::uint32_t>(std::lround(1000.0 * *frames_per_second))};
    if (auto set = device.call(VIDIOC_S_PARM, &parameters, "setting the frame rate"); !set) {
      return forward(set);
    }
  }
  if (!settable) return std::nullopt;
  return interval_of(capture.timeperframe);
}

}  // namespace

Result<std::vector<V4l2OfferedFormat>> offered_formats(const V4l2Device& device) {
  std::vector<V4l2OfferedFormat> offered;
  for (std::uint32_t index = 0; index < kMostEntries; ++index) {
    v4l2_fmtdesc entry{};
    entry.index = index;
    entry.type = kCapture;
    const int outcome = device.ioctl(VIDIOC_ENUM_FMT, &entry);
    if (outcome == -EINVAL) break;
    if (outcome < 0) {
      return tl::unexpected(v4l2_error(device.node(), "listing its formats", -outcome));
    }
    V4l2OfferedFormat format;
    format.fourcc = entry.pixelformat;
    format.description = reinterpret_cast<const char*>(entry.description);
    enumerate_sizes(device, format);
    offered.push_back(std::move(format));
  }
  return offered;
}

std::string to_string(const std::vector<V4l2OfferedFormat>& offered) {
  std::string listing;
  for (const V4l2OfferedFormat& format : offered) {
    if (!listing.empty()) listing += ", ";
    listing += fourcc_name(format.fourcc);
    if (format.smallest) {
      listing += fmt::format(" {}x{} to", format.smallest->width, format.smallest->height);
    }
    for (const FrameSize& size : format.sizes) {
      listing += fmt::format(" {}x{}", size.width, size.height);
    }
  }
  return listing.empty() ? "nothing" : listing;
}

Result<V4l2StreamFormat> negotiate_format(const V4l2Device& device,
                                          const V4l2FormatRequest& request) {
  const Result<std::vector<V4l2OfferedFormat>> offered = offered_formats(device);
  if (!offered) return forward(offered);
  const Result<Choice> choice = choose(device, *offered, request);
  if (!choice) return forward(choice);

  v4l2_format format{};
  format.type = kCapture;
  v4l2_pix_format& pixels = format.fmt.pix;
  pixels.width = static_cast<std::uint32_t>(choice->size.width);
  pixels.height = static_cast<std::uint32_t>(choice->size.height);
  pixels.pixelformat = choice->fourcc;
  pixels.field = V4L2_FIELD_NONE;
  if (auto set = device.call(VIDIOC_S_FMT, &format, "setting the picture format"); !set) {
    return forward(set);
  }
  if (pixels.pixelformat != choice->fourcc) {
    return fail(ErrorKind::hardware, device.node(),
                fmt::format("was asked for the pixel format {} and answered with {}",
                            fourcc_name(choice->fourcc), fourcc_name(pixels.pixelformat)),
                fmt::format("choose from what it offers: {}", to_string(*offered)));
  }
  const FrameSize size = frame_size(pixels.width, pixels.height);
  if (request.size && size != *request.size && !request.allow_other_size) {
    return fail(ErrorKind::hardware, device.node(),
                fmt::format("was asked for {}x{} and answered with {}x{}", request.size->width,
                            request.size->height, size.width, size.height),
                fmt::format("choose from what it offers in {}: {}", fourcc_name(choice->fourcc),
                            to_string(*offered)));
  }
  if (pixels.field != V4L2_FIELD_NONE) {
    return fail(ErrorKind::hardware, device.node(), "delivers interlaced pictures",
                "choose a progressive input or another camera");
  }
  const Result<RawImageFormat> image = image_format(device, pixels);
  if (!image) return forward(image);
  const auto interval = set_rate(device, request.frames_per_second);
  if (!interval) return forward(interval);
  return V4l2StreamFormat{pixels.pixelformat, *image, pixels.sizeimage, *interval};
}

}  // namespace skullstation
