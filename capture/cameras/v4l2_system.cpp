#include "capture/cameras/v4l2_system.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <functional>

namespace skullstation {
namespace {

using std::chrono::nanoseconds;

/// A descriptor that becomes readable when stop is requested, so that poll() sees it at once.
class StopDescriptor {
 public:
  explicit StopDescriptor(std::stop_token stop)
      : descriptor_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        signal_(std::move(stop), [this] { ::eventfd_write(descriptor_, 1); }) {}
  // The callback goes first (it is declared last), so it can't write to a closed descriptor.
  ~StopDescriptor() = default;
  StopDescriptor(const StopDescriptor&) = delete;
  StopDescriptor& operator=(const StopDescriptor&) = delete;

  int value() const { return descriptor_.value; }

 private:
  struct Descriptor {
    explicit Descriptor(int opened) : value(opened) {}
    ~Descriptor() {
      if (value >= 0) ::close(value);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    operator int() const { return value; }
    int value;
  };

  Descriptor descriptor_;
  std::stop_callback<std::function<void()>> signal_;
};

class KernelV4l2System final : public V4l2System {
 public:
  std::filesystem::path root() const override { return "/"; }

  Instant now() const override { return std::chrono::steady_clock::now(); }

  int open(const std::string& node) override {
    int descriptor = -1;
    do {
      descriptor = ::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    } while (descriptor < 0 && errno == EINTR);
    return descriptor < 0 ? -errno : descriptor;
  }

  void close(int descriptor) override { ::close(descriptor); }

  int ioctl(int descriptor, unsigned long request, void* argument) override {
    int outcome = -1;
    do {
      outcome = ::ioctl(descriptor, request, argument);
    } while (outcome < 0 && errno == EINTR);
    return outcome < 0 ? -errno : outcome;
  }

  void* map(int descriptor, std::size_t length, std::int64_t offset) override {
    void* address = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, descriptor, offset);
    return address == MAP_FAILED ? nullptr : address;
  }

  void unmap(void* address, std::size_t length) override { ::munmap(address, length); }

  int wait(int descriptor, Instant deadline, std::stop_token stop) override {
    const StopDescriptor stopped(stop);
    if (stopped.value() < 0) return -errno;
    for (;;) {
      if (stop.stop_requested()) return -ECANCELED;
      const nanoseconds left = std::max(nanoseconds{deadline - now()}, nanoseconds{0});
      const timespec timeout{static_cast<time_t>(left.count() / 1'000'000'000),
                             static_cast<long>(left.count() % 1'000'000'000)};
      std::array<pollfd, 2> watched{{{descriptor, POLLIN, 0}, {stopped.value(), POLLIN, 0}}};
      const int ready = ::ppoll(watched.data(), watched.size(), &timeout, nullptr);
      if (ready < 0 && errno == EINTR) continue;
      if (ready < 0) return -errno;
      if (stop.stop_requested()) return -ECANCELED;
      if ((watched[0].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return -EPIPE;
      if ((watched[0].revents & POLLIN) != 0) return 1;
      if (ready == 0) return 0;
    }
  }
};

}  // namespace

std::shared_ptr<V4l2System> kernel_v4l2_system() { return std::make_shared<KernelV4l2System>(); }

}  // namespace skullstation
