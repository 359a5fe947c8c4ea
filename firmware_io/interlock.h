#pragma once

#include <functional>
#include <string>

#include "core/result.h"

namespace skullstation {

/// Emergency stop and door interlock. The E-stop cuts the motor driver in hardware; software
/// learns of it, stops stepping before the next step and stays stopped (latched) until reset.
class Interlock {
 public:
  virtual ~Interlock() = default;

  /// True from the moment a stop or an open door was seen until a successful reset(). Safe to
  /// call from the stepping thread before each step: it never blocks.
  virtual bool tripped() const noexcept = 0;

  /// What tripped it, for a person: "emergency stop pressed", "door open"; empty if not tripped.
  virtual std::string reason() const = 0;

  /// Unlatches. Fails while the button is still pressed or the door still open.
  virtual Result<void> reset() = 0;

  /// `on_trip` runs on the interlock's own thread at each trip. Replaces the one before; an empty
  /// function takes it away (afterwards none is running).
  virtual void on_trip(std::function<void()> callback) = 0;
};

}  // namespace skullstation
