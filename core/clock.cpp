#include "core/clock.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <condition_variable>
#include <mutex>

namespace skullstation {

using std::chrono::nanoseconds;

Instant SystemClock::now() const { return std::chrono::steady_clock::now(); }

UtcTime SystemClock::utc_now() const { return std::chrono::system_clock::now(); }

bool SystemClock::sleep_until(Instant deadline, std::stop_token stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_until(lock, stop, deadline, [] { return false; });
  return !stop.stop_requested();
}

SimulatedClock::SimulatedClock(UtcTime start) : start_(start) {}

Instant SimulatedClock::now() const { return Instant{nanoseconds{elapsed_ns_.load()}}; }

UtcTime SimulatedClock::utc_now() const {
  return start_ + std::chrono::duration_cast<UtcTime::duration>(nanoseconds{elapsed_ns_.load()});
}

bool SimulatedClock::sleep_until(Instant deadline, std::stop_token stop) {
  if (stop.stop_requested()) return false;
  const std::int64_t target = nanoseconds{deadline.time_since_epoch()}.count();
  std::int64_t elapsed = elapsed_ns_.load();
  while (elapsed < target && !elapsed_ns_.compare_exchange_weak(elapsed, target)) {
  }
  return true;
}

std::string to_iso8601(UtcTime time) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time - whole).count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(whole)), ms);
}

}  // namespace skullstation
