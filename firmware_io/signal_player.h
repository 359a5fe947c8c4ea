#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "firmware_io/panel.h"

namespace skullstation {

/// What is on at one moment.
struct PanelState {
  bool green = false;
  bool yellow = false;
  bool red = false;
  bool buzzer = false;
  bool operator==(const PanelState&) const = default;
};

/// What a signal looks and sounds like so long after it was first shown.
PanelState panel_at(Signal signal, std::chrono::milliseconds shown_for);

/// When it next looks or sounds different; nothing if it stays as it is.
std::optional<std::chrono::milliseconds> next_change(Signal signal,
                                                     std::chrono::milliseconds shown_for);

/// Makes lamps blink and a buzzer beep by a thread of its own.
class SignalPlayer final : public SignalLamp {
 public:
  /// `apply` drives the lines; it is called from one thread at a time.
  explicit SignalPlayer(std::function<Result<void>(PanelState)> apply);
  ~SignalPlayer() override;  ///< everything off
  SignalPlayer(const SignalPlayer&) = delete;
  SignalPlayer& operator=(const SignalPlayer&) = delete;

  /// Fails if the lines can't be set, now or since the last call.
  Result<void> show(Signal signal) override;

 private:
  void play(const std::stop_token& stop);

  const std::function<Result<void>(PanelState)> apply_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  Signal signal_ = Signal::off;
  std::chrono::steady_clock::time_point shown_at_;
  Result<void> last_;
  std::jthread player_;  // last: it uses everything above
};

}  // namespace skullstation
