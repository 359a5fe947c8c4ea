#pragma once

#include <libcamera/camera.h>
#include <libcamera/framebuffer_allocator.h>
#include <libcamera/request.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "capture/cameras/libcamera_camera.h"
#include "capture/cameras/pixel_format.h"
#include "core/clock.h"

namespace skullstation {

/// What libcamera's own thread hands over: finished requests, and the news of an unplugged camera.
class CompletionQueue {
 public:
  enum class Wake { request, timed_out, stopped, unplugged };

  void completed(libcamera::Request* request);
  void disconnected();

  /// The next finished request, in order.
  Wake next(Instant deadline, std::stop_token stop, libcamera::Request*& request);
  void clear();

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<libcamera::Request*> requests_;
  bool unplugged_ = false;
};

/// The buffers of one stream, mapped for reading.
class MappedFrameBuffers {
 public:
  MappedFrameBuffers() = default;
  MappedFrameBuffers(const MappedFrameBuffers&) = delete;
  MappedFrameBuffers& operator=(const MappedFrameBuffers&) = delete;
  ~MappedFrameBuffers();

  Result<void> map(const libcamera::FrameBuffer& buffer, const std::string& camera);

  /// The bytes of a filled buffer as one block, its planes one behind the other.
  std::vector<std::uint8_t> read(const libcamera::FrameBuffer& buffer,
                                 const RawImageFormat& format) const;

 private:
  struct Mapping {
    int descriptor;
    void* address;
    std::size_t length;
  };
  const Mapping* find(int descriptor) const;

  std::vector<Mapping> mappings_;
};

/// A camera that is acquired, configured and started. The destructor stops and releases it.
class LibcameraStream {
 public:
  /// Errors (kind hardware): busy, no usable format, another size than asked, no memory.
  static Result<std::unique_ptr<LibcameraStream>> open(std::shared_ptr<libcamera::Camera> camera,
                                                       const LibcameraConfig& config);
  LibcameraStream(const LibcameraStream&) = delete;
  LibcameraStream& operator=(const LibcameraStream&) = delete;
  ~LibcameraStream();

  libcamera::Camera& camera() const { return *camera_; }
  const RawImageFormat& format() const { return format_; }
  const std::string& format_name() const { return format_name_; }

  /// Starts, or stops and starts again, with the given controls.
  Result<void> start(const libcamera::ControlList& controls);

  /// The next finished request; nothing if none came before the deadline. Errors: kind cancelled
  /// on a stop request, kind hardware if the camera was unplugged or cancelled the request.
  Result<libcamera::Request*> next(Instant deadline, std::stop_token stop);

  const libcamera::FrameBuffer& buffer_of(const libcamera::Request& request) const;
  std::vector<std::uint8_t> read(const libcamera::FrameBuffer& buffer) const {
    return mapped_.read(buffer, format_);
  }

  Result<void> give_back(libcamera::Request* request);

 private:
  explicit LibcameraStream(std::shared_ptr<libcamera::Camera> camera)
      : camera_(std::move(camera)) {}
  Result<void> acquire();
  Result<void> configure(const LibcameraConfig& config);
  Result<void> make_requests();
  void stop();

  std::shared_ptr<libcamera::Camera> camera_;
  CompletionQueue completed_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  libcamera::Stream* stream_ = nullptr;
  RawImageFormat format_;
  std::string format_name_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  MappedFrameBuffers mapped_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;
  bool acquired_ = false;
  bool running_ = false;
};

}  // namespace skullstation
