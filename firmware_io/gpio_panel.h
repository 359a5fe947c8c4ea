#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/clock.h"
#include "firmware_io/gpio_lines.h"
#include "firmware_io/press_detector.h"
#include "firmware_io/trip_latch.h"

namespace skullstation {

/// The wires of a panel that are listened to, and the one that a trip cuts.
struct GpioPanelLines {
  NamedLine estop;
  NamedLine door;
  NamedLine button;
  NamedLine enable;  ///< of the motor driver
};

/// Hears stop, door and button by a thread of its own. Safe from any thread.
class GpioPanel {
 public:
  /// Takes over `wake_fd`, an eventfd that ends the thread. A stop that is active trips at once.
  GpioPanel(GpioPanelLines lines, const ButtonTiming& timing, Clock& clock, int wake_fd);
  ~GpioPanel();
  GpioPanel(const GpioPanel&) = delete;
  GpioPanel& operator=(const GpioPanel&) = delete;

  TripLatch& latch() { return latch_; }
  Result<void> enable(bool on) { return lines_.enable.set(on); }
  Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                              const std::stop_token& stop);

 private:
  Result<std::string> still_active();
  void cut_current();
  bool trip_if_active();
  void go_deaf(Error error);

  void listen();
  int milliseconds_to_wait(Instant now) const;
  bool hear_stop(NamedLine& line, const char* text);
  bool hear_button();
  void tell_presses(Instant until);

  GpioPanelLines lines_;
  Clock& clock_;
  const int wake_fd_;
  PressDetector detector_;  // the listener's own

  std::mutex mutex_;
  std::condition_variable_any pressed_;
  std::deque<Press> presses_;
  std::optional<Error> deaf_;  // why no edge will ever be heard again

  TripLatch latch_;
  std::jthread listener_;
};

}  // namespace skullstation
