#include "firmware_io/trip_latch.h"

#include <utility>

namespace skullstation {

TripLatch::TripLatch(Backend backend)
    : backend_(std::move(backend)),
      notifier_([this](const std::stop_token& stop) { notify(stop); }) {}

TripLatch::~TripLatch() = default;

void TripLatch::trip(std::string reason) {
  {
    const std::lock_guard lock(mutex_);
    if (tripped_) return;
    tripped_ = true;
    ++trips_;
    reason_ = std::move(reason);
  }
  backend_.cut_current();
  trip_seen_.notify_all();
}

std::string TripLatch::reason() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

Result<void> TripLatch::reset() {
  // Under the lock: a press that comes after the look at the lines waits, and latches again.
  const std::lock_guard lock(mutex_);
  const auto active = backend_.still_active();
  if (!active) return forward(active);
  if (!active->empty()) {
    return fail(ErrorKind::hardware, "interlock", "can't be reset: " + *active,
                "release it, then reset again");
  }
  tripped_ = false;
  reason_.clear();
  return {};
}

void TripLatch::on_trip(std::function<void()> callback) {
  const std::lock_guard lock(callback_mutex_);
  callback_ = std::move(callback);
  trips_before_callback_ = trips_;
}

void TripLatch::notify(const std::stop_token& stop) {
  for (long trip = 1;; ++trip) {
    {
      std::unique_lock lock(mutex_);
      if (!trip_seen_.wait(lock, stop, [&] { return trips_ >= trip; })) return;
    }
    const std::lock_guard lock(callback_mutex_);
    const auto callback = callback_;  // a copy, since it may replace itself
    if (callback && trip > trips_before_callback_) callback();
  }
}

}  // namespace skullstation
