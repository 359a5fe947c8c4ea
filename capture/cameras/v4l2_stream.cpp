#include "capture/cameras/v4l2_stream.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace skullstation {
namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;

v4l2_buffer mapped_buffer(std::uint32_t index = 0) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = kCapture;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

}  // namespace

Result<V4l2Stream> V4l2Stream::start(const V4l2Device& device, int buffer_count) {
  V4l2Stream stream(device);
  if (auto mapped = stream.map_buffers(buffer_count); !mapped) return forward(mapped);
  auto type = static_cast<int>(kCapture);
  if (auto on = device.call(VIDIOC_STREAMON, &type, "starting the stream"); !on) {
    return forward(on);
  }
  return stream;
}

Result<void> V4l2Stream::map_buffers(int buffer_count) {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(buffer_count);
  request.type = kCapture;
  request.memory = V4L2_MEMORY_MMAP;
  if (auto granted = device_->call(VIDIOC_REQBUFS, &request, "reserving buffers"); !granted) {
    return granted;
  }
  if (request.count < 2) {
    return fail(
        ErrorKind::hardware, device_->node(),
        fmt::format("grants {} buffers of the 2 or more that streaming needs", request.count),
        "free some memory");
  }
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer = mapped_buffer(index);
    if (auto told = device_->call(VIDIOC_QUERYBUF, &buffer, "mapping its buffers"); !told) {
      return told;
    }
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
      return fail(ErrorKind::hardware, device_->node(),
                  "its driver does not stamp frames with the monotonic clock, so an old picture "
                  "could not be told from a new one",
                  "use another camera or driver");
    }
    void* address = device_->system().map(device_->descriptor(), buffer.length, buffer.m.offset);
    if (address == nullptr) {
      return fail(ErrorKind::hardware, device_->node(),
                  fmt::format("buffer {} of {} bytes can't be mapped", index, buffer.length),
                  "free some memory");
    }
    mappings_.push_back({address, buffer.length});
    if (auto queued = device_->call(VIDIOC_QBUF, &buffer, "queuing its buffers"); !queued) {
      return queued;
    }
  }
  return {};
}

V4l2Stream::V4l2Stream(V4l2Stream&& other) noexcept
    : device_(std::exchange(other.device_, nullptr)), mappings_(std::move(other.mappings_)) {}

V4l2Stream::~V4l2Stream() {
  if (device_ == nullptr) return;
  // Failures are of no interest here: the device may be gone.
  auto type = static_cast<int>(kCapture);
  device_->ioctl(VIDIOC_STREAMOFF, &type);
  for (const Mapping& mapping : mappings_) {
    device_->system().unmap(mapping.address, mapping.length);
  }
  v4l2_requestbuffers none{};
  none.type = kCapture;
  none.memory = V4L2_MEMORY_MMAP;
  device_->ioctl(VIDIOC_REQBUFS, &none);
}

Result<std::optional<V4l2Buffer>> V4l2Stream::next(Instant deadline, const std::stop_token& stop) {
  const std::string& node = device_->node();
  for (;;) {
    const int woken = device_->system().wait(device_->descriptor(), deadline, stop);
    if (woken == -ECANCELED) {
      return fail(ErrorKind::cancelled, node, "stopped while waiting for a picture");
    }
    if (woken == 0) return std::nullopt;
    if (woken < 0 && woken != -EPIPE) {
      return tl::unexpected(v4l2_error(node, "waiting for a picture", -woken));
    }
    v4l2_buffer buffer = mapped_buffer();
    const int taken = device_->ioctl(VIDIOC_DQBUF, &buffer);
    if (taken == -EAGAIN) {
      if (woken > 0 && device_->system().now() < deadline) continue;  // woken for nothing
      if (woken > 0) return std::nullopt;
      return tl::unexpected(v4l2_error(node, "waiting for a picture", EPIPE));
    }
    if (taken < 0) return tl::unexpected(v4l2_error(node, "taking a picture", -taken));
    if (buffer.index >= mappings_.size()) {
      return fail(
          ErrorKind::hardware, node,
          fmt::format("its driver returned buffer {} of {}", buffer.index, mappings_.size()));
    }
    const Mapping& mapping = mappings_[buffer.index];
    const std::size_t used = std::min<std::size_t>(buffer.bytesused, mapping.length);
    const auto since_boot = std::chrono::seconds{buffer.timestamp.tv_sec} +
                            std::chrono::microseconds{buffer.timestamp.tv_usec};
    return V4l2Buffer{
        .index = buffer.index,
        .bytes = {static_cast<const std::uint8_t*>(mapping.address), used},
        .timestamp = Instant{since_boot},
        .exposure_start_stamped =
            (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
        .damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0,
        .sequence = buffer.sequence,
    };
  }
}

Result<void> V4l2Stream::give_back(const V4l2Buffer& buffer) {
  v4l2_buffer queued = mapped_buffer(buffer.index);
  return device_->call(VIDIOC_QBUF, &queued, "handing a buffer back");
}

}  // namespace skullstation
