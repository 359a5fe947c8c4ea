#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/cameras/pixel_format.h"
#include "capture/cameras/v4l2_device.h"

namespace skullstation {

struct FrameSize {
  int width = 0;
  int height = 0;
  bool operator==(const FrameSize&) const = default;
};

/// One pixel format that a device offers.
struct V4l2OfferedFormat {
  std::uint32_t fourcc = 0;
  std::string description;            ///< "YUYV 4:2:2"
  std::vector<FrameSize> sizes;       ///< discrete sizes, or the largest of a range; may be unknown
  std::optional<FrameSize> smallest;  ///< set if any size from here to sizes.front() will do
};

/// What to ask a device for. Whatever is unset is chosen.
struct V4l2FormatRequest {
  std::optional<FrameSize> size = {};            ///< unset: the largest offered
  std::optional<std::string> format = {};        ///< four-character code; unset: the best offered
  std::optional<double> frames_per_second = {};  ///< unset: as the device has it
  bool allow_other_size = false;                 ///< take the size the driver makes of it
};

/// What the device will stream.
struct V4l2StreamFormat {
  std::uint32_t fourcc = 0;
  RawImageFormat image;
  std::size_t buffer_bytes = 0;
  std::optional<std::chrono::nanoseconds> frame_interval;
};

/// Everything the device offers, in its own order.
Result<std::vector<V4l2OfferedFormat>> offered_formats(const V4l2Device& device);

/// "YUYV 640x480 1280x720, MJPG 1920x1080".
std::string to_string(const std::vector<V4l2OfferedFormat>& offered);

/// Sets format, size and rate. Without a wish, the format is the first of RGB, YUYV/UYVY,
/// NV12/NV21, MJPEG, Bayer, grey that comes in the wanted size and, if asked, at the wanted rate.
/// Errors: kind bad_input for a wish that the device can't fulfil, naming what it offers; kind
/// hardware if the driver answers with another size (unless allowed), another format or
/// interlaced pictures.
Result<V4l2StreamFormat> negotiate_format(const V4l2Device& device,
                                          const V4l2FormatRequest& request);

}  // namespace skullstation
