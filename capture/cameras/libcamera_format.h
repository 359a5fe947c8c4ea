#pragma once

#include <libcamera/stream.h>

#include <optional>

#include "capture/cameras/pixel_format.h"
#include "core/result.h"

namespace skullstation {

/// libcamera names formats as DRM does, which for RGB is the reverse of the order in memory.
std::optional<PixelFormat> pixel_format_from_libcamera(const libcamera::PixelFormat& format);

/// The best of the offered formats that can be decoded: RGB, YUYV/UYVY, NV12/NV21, MJPEG, Bayer
/// (most bits first), grey.
std::optional<libcamera::PixelFormat> best_libcamera_format(
    const std::vector<libcamera::PixelFormat>& offered);

/// How buffers of a validated stream are to be read. Its format must be one that can be decoded.
RawImageFormat image_format(const libcamera::StreamConfiguration& stream);

}  // namespace skullstation
