#pragma once

#include <chrono>
#include <optional>
#include <stop_token>

#include "core/result.h"

namespace skullstation {

enum class Press {
  brief,  ///< start, confirm
  held,   ///< cancel; reported while the button is still down
};

class Button {
 public:
  virtual ~Button() = default;

  /// The next press since the last call (presses queue up), or nothing on time-out or stop.
  /// Fails if the device is gone.
  virtual Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                                      std::stop_token stop) = 0;
};

/// What the operator must be able to tell across the room, gloves on, without a screen.
enum class Signal {
  off,
  ready,      ///< green steady
  working,    ///< yellow steady: scanning
  attention,  ///< yellow blinking, two short beeps: "turn it over"
  building,   ///< green and yellow steady, one short beep: saved, the next specimen may come
  done,       ///< green blinking, one long beep
  fault,      ///< red steady, three beeps
};

/// Lamps and buzzer.
class SignalLamp {
 public:
  virtual ~SignalLamp() = default;

  /// Shows the signal from now on; blinking and beeping go on by themselves.
  virtual Result<void> show(Signal signal) = 0;
};

/// The light on the specimen.
class Lights {
 public:
  virtual ~Lights() = default;
  virtual Result<void> set(bool on) = 0;
};

}  // namespace skullstation
