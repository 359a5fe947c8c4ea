#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>

#include "core/clock.h"
#include "firmware_io/step_driver.h"
#include "firmware_io/trip_latch.h"
#include "firmware_io/turntable.h"
#include "firmware_io/turntable_config.h"

namespace skullstation {

/// A turntable on a step motor without an encoder: the position is the number of steps made since
/// homing, an integer, so that it can't drift. Each motion is planned as a whole, then made on a
/// thread of its own against absolute deadlines; a late wake-up shifts the rest of the motion, so
/// that steps never come closer together than planned. Simulated and real motors share this class.
class SteppedTurntable final : public Turntable {
 public:
  /// \pre config.validate() holds.
  SteppedTurntable(std::unique_ptr<StepDriver> driver, std::shared_ptr<const TripLatch> interlock,
                   const TurntableConfig& config, Clock& clock);
  ~SteppedTurntable() override;  ///< switches the current off

  Result<void> home(std::stop_token stop) override;
  Result<void> move_to(double angle_deg, std::stop_token stop) override;
  Result<void> release() override;
  std::optional<double> angle_deg() const override;
  SteppingDiagnostics diagnostics() const override;

 private:
  /// A motion, and the level of the index switch that ends it early.
  struct Travel {
    long steps = 0;
    MotionLimits limits;
    std::optional<bool> until_index;
  };
  /// The position at which the index switch first had the level looked for, if it had.
  using Sighting = std::optional<long>;

  Result<void> find_zero(const std::stop_token& stop);
  Result<void> approach(long position, const std::stop_token& stop);
  Result<void> turn_by(long steps, const std::stop_token& stop);
  Result<Sighting> seek_index(bool closed, long steps, double speed_deg_s,
                              const std::stop_token& stop);
  Result<Sighting> travel(const Travel& travel, const std::stop_token& stop);
  Result<Sighting> make_steps(const Travel& travel, MotionPlan plan, const std::stop_token& stop);

  Result<void> switch_current_on();
  void switch_current_off();
  bool interlock_intervened() const { return interlock_->trips() != trips_seen_; }
  tl::unexpected<Error> stopped_by_interlock() const;
  void step_was_made(int direction, std::chrono::nanoseconds lateness);
  long steps_in(double angle_deg) const;

  const std::unique_ptr<StepDriver> driver_;
  const std::shared_ptr<const TripLatch> interlock_;
  const TurntableConfig config_;
  Clock& clock_;

  std::mutex moving_;  // one motion at a time
  std::atomic<long> position_{0};
  std::atomic<bool> homed_{false};
  std::atomic<long> trips_seen_{0};  // the interlock's count when current and position were sound
  bool current_on_ = false;
  long slack_ = 0;  // counter-clockwise steps after which the gear surely bears on that side

  mutable std::mutex diagnostics_mutex_;
  SteppingDiagnostics diagnostics_;
};

}  // namespace skullstation
