#pragma once

#include <atomic>
#include <chrono>
#include <stop_token>
#include <string>
#include <utility>

namespace skullstation {

/// A moment on the kernel's CLOCK_MONOTONIC, the time base of V4L2 frames and GPIO edges.
using Instant = std::chrono::steady_clock::time_point;
using UtcTime = std::chrono::system_clock::time_point;

/// Time is passed in, never asked of the system directly, so that a whole scan can be tested in
/// virtual time.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual Instant now() const = 0;
  virtual UtcTime utc_now() const = 0;
  /// Returns true at `deadline` (at once if it has passed), false as soon as stop is requested.
  virtual bool sleep_until(Instant deadline, std::stop_token stop) = 0;

  bool sleep_for(std::chrono::nanoseconds duration, std::stop_token stop) {
    return sleep_until(now() + duration, std::move(stop));
  }
};

class SystemClock final : public Clock {
 public:
  Instant now() const override;
  UtcTime utc_now() const override;
  bool sleep_until(Instant deadline, std::stop_token stop) override;
};

/// Virtual time: sleeping advances it at once. Starts at the given UTC time, so that whatever a
/// simulated station writes is the same in every run. Safe to read from several threads.
class SimulatedClock final : public Clock {
 public:
  explicit SimulatedClock(UtcTime start = UtcTime{std::chrono::seconds{1767225600}});
  Instant now() const override;
  UtcTime utc_now() const override;
  bool sleep_until(Instant deadline, std::stop_token stop) override;

 private:
  UtcTime start_;
  std::atomic<std::int64_t> elapsed_ns_{0};
};

/// "2026-01-31T12:00:00.000Z"
std::string to_iso8601(UtcTime time);

}  // namespace skullstation
