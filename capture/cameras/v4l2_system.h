#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>

#include "core/clock.h"

namespace skullstation {

/// The system calls that a V4L2 camera makes: the kernel's own, or a scripted device in tests.
/// Calls return 0 or more for success and -errno for failure.
class V4l2System {
 public:
  virtual ~V4l2System() = default;

  /// Where dev/ and sys/ lie: "/".
  virtual std::filesystem::path root() const = 0;

  virtual Instant now() const = 0;

  /// A descriptor that doesn't block.
  virtual int open(const std::string& node) = 0;
  virtual void close(int descriptor) = 0;

  /// Repeated when a signal interrupts it.
  virtual int ioctl(int descriptor, unsigned long request, void* argument) = 0;

  /// Maps a buffer for reading; a null pointer on failure.
  virtual void* map(int descriptor, std::size_t length, std::int64_t offset) = 0;
  virtual void unmap(void* address, std::size_t length) = 0;

  /// Waits for a frame: 1 when one can be taken, 0 when the deadline passed, -ECANCELED as soon as
  /// stop is requested, -EPIPE when the device reports an error or a hang-up (taking a frame then
  /// tells why).
  virtual int wait(int descriptor, Instant deadline, std::stop_token stop) = 0;
};

std::shared_ptr<V4l2System> kernel_v4l2_system();

}  // namespace skullstation
