#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

namespace skullstation {

/// What one listener of the event stream is still to be sent. Written to by whoever has news, read
/// by the connection.
class EventQueue {
 public:
  /// A listener that is this far behind is gone, or too slow to be told anything.
  static constexpr std::size_t most_bytes = std::size_t{1} << 20;

  /// Closes the queue instead where the listener is too far behind. False once it is closed.
  bool push(const std::string& event) {
    std::function<void()> wake;
    bool taken = false;
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return false;
      taken = waiting_.size() + event.size() <= most_bytes;
      if (taken) waiting_ += event;
      closed_ = !taken;
      wake = wake_;
    }
    if (wake) wake();
    return taken;
  }

  void close() {
    std::function<void()> wake;
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      wake = wake_;
    }
    if (wake) wake();
  }

  /// The connection's part: called, from any thread, when there is something to take.
  void on_news(std::function<void()> wake) {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
  }
  std::string take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(waiting_, {});
  }
  bool closed() const {
    const std::lock_guard lock(mutex_);
    return closed_;
  }

 private:
  mutable std::mutex mutex_;
  std::string waiting_;
  bool closed_ = false;
  std::function<void()> wake_;
};

}  // namespace skullstation
