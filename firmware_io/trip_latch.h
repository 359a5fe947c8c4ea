#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "firmware_io/interlock.h"

namespace skullstation {

/// The latch behind every interlock: what trips it and what it cuts belongs to the backend.
/// Safe from any thread.
class TripLatch {
 public:
  struct Backend {
    /// What is pressed or open at this moment ("emergency stop pressed"); empty if nothing.
    std::function<Result<std::string>()> still_active;
    /// Takes the motor's current away. Called at each trip, on the thread that saw it.
    std::function<void()> cut_current;
  };

  explicit TripLatch(Backend backend);
  ~TripLatch();
  TripLatch(const TripLatch&) = delete;
  TripLatch& operator=(const TripLatch&) = delete;

  /// Latches. The first reason stands until the reset.
  void trip(std::string reason);

  bool tripped() const noexcept { return tripped_.load(); }
  /// How often it tripped so far: whoever saw an older number has lost the motor's current since.
  long trips() const noexcept { return trips_.load(); }
  std::string reason() const;
  Result<void> reset();
  void on_trip(std::function<void()> callback);

 private:
  void notify(const std::stop_token& stop);

  const Backend backend_;
  std::atomic<bool> tripped_{false};
  std::atomic<long> trips_{0};

  mutable std::mutex mutex_;
  std::condition_variable_any trip_seen_;
  std::string reason_;

  // Held while the callback runs, so that replacing it waits for its end; recursive, since the
  // callback itself may replace it.
  std::recursive_mutex callback_mutex_;
  std::function<void()> callback_;
  long trips_before_callback_ = 0;

  std::jthread notifier_;  // last: it uses everything above
};

/// The Interlock that a program holds.
class LatchedInterlock final : public Interlock {
 public:
  explicit LatchedInterlock(std::shared_ptr<TripLatch> latch) : latch_(std::move(latch)) {}

  bool tripped() const noexcept override { return latch_->tripped(); }
  std::string reason() const override { return latch_->reason(); }
  Result<void> reset() override { return latch_->reset(); }
  void on_trip(std::function<void()> callback) override { latch_->on_trip(std::move(callback)); }

 private:
  std::shared_ptr<TripLatch> latch_;
};

}  // namespace skullstation
