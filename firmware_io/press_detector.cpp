#include "firmware_io/press_detector.h"

#include <fmt/format.h>

#include <utility>

namespace skullstation {

using std::chrono::milliseconds;

Result<void> ButtonTiming::validate() const {
  if (debounce < milliseconds{0} || debounce > milliseconds{200}) {
    return fail(ErrorKind::bad_input, "debounce_ms",
                fmt::format("is {}; 0 to 200 was expected", debounce.count()));
  }
  if (held_after < 2 * debounce + milliseconds{100} || held_after > milliseconds{10'000}) {
    return fail(ErrorKind::bad_input, "held_after_ms",
                fmt::format("is {}; {} (twice the debounce time and 100) to 10000 was expected",
                            held_after.count(), (2 * debounce + milliseconds{100}).count()));
  }
  return {};
}

void PressDetector::edge(Instant at, bool down) {
  settle(at);
  level_ = down;
  level_since_ = at;
}

std::vector<PressDetector::Detected> PressDetector::advance(Instant now) {
  settle(now);
  return std::exchange(detected_, {});
}

std::optional<Instant> PressDetector::next_decision() const {
  if (level_ != settled_) return level_since_ + timing_.debounce;
  if (settled_ && !told_held_) return pressed_at_ + timing_.held_after;
  return std::nullopt;
}

void PressDetector::settle(Instant now) {
  if (level_ != settled_ && now >= level_since_ + timing_.debounce) {
    settled_ = level_;
    if (settled_) {
      pressed_at_ = level_since_;
      told_held_ = false;
    } else if (!told_held_) {
      detected_.push_back({Press::brief, level_since_ + timing_.debounce});
    }
  }
  const bool still_down = settled_ && level_;
  if (still_down && !told_held_ && now >= pressed_at_ + timing_.held_after) {
    told_held_ = true;
    detected_.push_back({Press::held, pressed_at_ + timing_.held_after});
  }
}

}  // namespace skullstation
