#pragma once

#include <chrono>
#include <optional>

#include "core/clock.h"

namespace skullstation {

/// What moment of a frame its timestamp marks.
enum class TimestampSource {
  exposure_start,  ///< the driver says so and its hardware knows
  readout,         ///< some moment between the first line's readout and the arrival of the last
};

/// The earliest moment at which light of this frame can have been collected. With a rolling
/// shutter, lines are exposed one after another; the first line's exposure ends when its readout
/// begins, and all lines are read within one frame interval. So the exposure began no earlier than
/// frame interval + exposure before any moment of the readout. An unknown exposure is at most one
/// frame interval long: a streaming sensor can't expose longer.
Instant earliest_exposure_start(Instant timestamp, TimestampSource source,
                                std::chrono::nanoseconds frame_interval,
                                std::optional<std::chrono::nanoseconds> exposure);

/// Frame interval: what the device claims, or longer if its frames show that (cameras slow down
/// in the dark). Unknown until the device claims one or two frames were seen.
class FrameInterval {
 public:
  explicit FrameInterval(std::optional<std::chrono::nanoseconds> claimed = {})
      : claimed_(claimed) {}

  void note(Instant timestamp, std::uint32_t sequence);
  std::optional<std::chrono::nanoseconds> value() const;

 private:
  struct Seen {
    Instant timestamp;
    std::uint32_t sequence;
  };
  std::optional<std::chrono::nanoseconds> claimed_;
  std::optional<std::chrono::nanoseconds> measured_;
  std::optional<Seen> last_;
};

}  // namespace skullstation
