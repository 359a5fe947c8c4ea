#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "core/clock.h"
#include "firmware_io/panel.h"

namespace skullstation {

/// How a button's contact is read.
struct ButtonTiming {
  std::chrono::milliseconds debounce{20};      ///< a level counts once it stood this long
  std::chrono::milliseconds held_after{1500};  ///< a press this long is Press::held

  Result<void> validate() const;
};

/// Turns a bouncing contact's edges into presses, by the edges' own time stamps: pure logic, no
/// thread, no clock.
class PressDetector {
 public:
  explicit PressDetector(const ButtonTiming& timing) : timing_(timing) {}

  struct Detected {
    Press press;
    Instant at;  ///< when it was certain
  };

  /// The contact changed. Edges come in the order of time; a repeated level is one more bounce.
  void edge(Instant at, bool down);

  /// Presses that are certain given that every edge up to `now` was reported; each is told once.
  std::vector<Detected> advance(Instant now);

  /// When advance() may have something new to tell without a further edge.
  std::optional<Instant> next_decision() const;

 private:
  void settle(Instant now);

  ButtonTiming timing_;
  bool level_ = false;    // as the last edge left it
  Instant level_since_;   // the last edge
  bool settled_ = false;  // debounced
  Instant pressed_at_;    // when the settled level went down
  bool told_held_ = false;
  std::vector<Detected> detected_;
};

}  // namespace skullstation
