#include "capture/cameras/v4l2_device.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace skullstation {
namespace {

/// Fixed-size, possibly unterminated text of the kernel's structs.
template <std::size_t N>
std::string text(const __u8 (&bytes)[N]) {
  const auto* begin = reinterpret_cast<const char*>(bytes);
  return {begin, ::strnlen(begin, N)};
}

}  // namespace

Error v4l2_error(const std::string& device, std::string_view doing, int error_number) {
  const auto hardware = [&device](std::string what, std::string advice) {
    return Error{ErrorKind::hardware, device, std::move(what), std::move(advice)};
  };
  switch (error_number) {
    case ENOENT:
      return hardware("there is no such device",
                      "plug the camera in; skullstation doctor lists the cameras that are there");
    case ENODEV:
    case ENXIO:
      return hardware(fmt::format("the camera was unplugged (while {})", doing),
                      "plug it in again and check cable and hub");
    case EBUSY:
      return hardware(fmt::format("the camera is in use by another program (while {})", doing),
                      fmt::format("close that program; fuser -v {} names it", device));
    case EACCES:
    case EPERM:
      return hardware(fmt::format("no permission to use the camera (while {})", doing),
                      "add the user to the group that owns the device, usually video");
    case ENOSPC:
      return hardware(fmt::format("the USB bus has not enough bandwidth left (while {})", doing),
                      "ask for MJPG, a smaller size or a lower rate, or move the camera to a USB "
                      "controller of its own");
    case EIO:
      return hardware(
          fmt::format("the camera stopped answering (input/output error while {})", doing),
          "reopen it; if that fails, unplug it and check cable, hub and power");
    case EPIPE:
      return hardware(fmt::format("the camera's stream broke (while {})", doing),
                      "reopen it; if it happens again, check cable, hub and power");
    default: return hardware(fmt::format("{} (while {})", std::strerror(error_number), doing), "");
  }
}

V4l2Device::V4l2Device(std::shared_ptr<V4l2System> system, int descriptor, std::string node)
    : system_(std::move(system)), descriptor_(descriptor), node_(std::move(node)) {}

V4l2Device::V4l2Device(V4l2Device&& other) noexcept
    : system_(std::move(other.system_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      node_(std::move(other.node_)),
      driver_(std::move(other.driver_)),
      model_(std::move(other.model_)),
      bus_(std::move(other.bus_)) {}

V4l2Device& V4l2Device::operator=(V4l2Device&& other) noexcept {
  std::swap(system_, other.system_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(node_, other.node_);
  std::swap(driver_, other.driver_);
  std::swap(model_, other.model_);
  std::swap(bus_, other.bus_);
  return *this;
}

V4l2Device::~V4l2Device() {
  if (descriptor_ >= 0) system_->close(descriptor_);
}

Result<V4l2Device> V4l2Device::open(std::shared_ptr<V4l2System> system, const std::string& node) {
  const int descriptor = system->open(node);
  if (descriptor < 0) return tl::unexpected(v4l2_error(node, "opening it", -descriptor));
  V4l2Device device(std::move(system), descriptor, node);

  v4l2_capability capability{};
  const int outcome = device.ioctl(VIDIOC_QUERYCAP, &capability);
  if (outcome == -ENOTTY || outcome == -EINVAL) {
    return fail(ErrorKind::hardware, node, "is not a video device",
                "name a /dev/video device; skullstation doctor lists the cameras");
  }
  if (outcome < 0) return tl::unexpected(v4l2_error(node, "asking what it is", -outcome));
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                ? capability.device_caps
                                : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return fail(ErrorKind::hardware, node,
                (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                    ? "is a camera with the multi-planar interface"
                    : "is a video device that takes no pictures (output, metadata or tuner)",
                (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                    ? "use it through libcamera"
                    : "a camera often has several nodes; skullstation doctor lists the right ones");
  }
  if ((can & V4L2_CAP_STREAMING) == 0) {
    return fail(ErrorKind::hardware, node, "can't stream into memory-mapped buffers",
                "use another camera or driver");
  }
  device.driver_ = text(capability.driver);
  device.model_ = text(capability.card);
  device.bus_ = text(capability.bus_info);
  return device;
}

Result<void> V4l2Device::call(unsigned long request, void* argument, std::string_view doing) const {
  const int outcome = ioctl(request, argument);
  if (outcome < 0) return tl::unexpected(v4l2_error(node_, doing, -outcome));
  return {};
}

}  // namespace skullstation
