#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "capture/cameras/v4l2_device.h"

namespace skullstation {

/// A filled buffer. Its bytes are the driver's memory: valid until it is given back.
struct V4l2Buffer {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes;
  Instant timestamp;
  bool exposure_start_stamped =
      false;             ///< the timestamp marks the start of exposure, says the driver
  bool damaged = false;  ///< flagged by the driver
  std::uint32_t sequence = 0;
};

/// Memory-mapped streaming of a device whose format is set. Started by start(); stops, unmaps and
/// releases in the destructor. The device must outlive it.
class V4l2Stream {
 public:
  /// Errors (kind hardware): busy, no memory, no bandwidth, timestamps that can't be compared with
  /// CLOCK_MONOTONIC (a stale frame couldn't be told from a fresh one).
  static Result<V4l2Stream> start(const V4l2Device& device, int buffer_count);

  V4l2Stream(V4l2Stream&& other) noexcept;
  V4l2Stream& operator=(V4l2Stream&&) = delete;
  ~V4l2Stream();

  /// The next filled buffer; nothing if none came before the deadline. Errors: kind cancelled on
  /// a stop request, kind hardware if the stream broke or the camera was unplugged.
  Result<std::optional<V4l2Buffer>> next(Instant deadline, const std::stop_token& stop);

  Result<void> give_back(const V4l2Buffer& buffer);

 private:
  struct Mapping {
    void* address;
    std::size_t length;
  };

  explicit V4l2Stream(const V4l2Device& device) : device_(&device) {}
  Result<void> map_buffers(int buffer_count);

  const V4l2Device* device_;
  std::vector<Mapping> mappings_;
};

}  // namespace skullstation
