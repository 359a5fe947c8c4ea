#include "capture/cameras/exposure_time.h"

#include <algorithm>

namespace skullstation {

using std::chrono::nanoseconds;

Instant earliest_exposure_start(Instant timestamp, TimestampSource source,
                                nanoseconds frame_interval, std::optional<nanoseconds> exposure) {
  if (source == TimestampSource::exposure_start) return timestamp;
  return timestamp - frame_interval - exposure.value_or(frame_interval);
}

void FrameInterval::note(Instant timestamp, std::uint32_t sequence) {
  if (last_ && sequence > last_->sequence && timestamp > last_->timestamp) {
    measured_ = (timestamp - last_->timestamp) / (sequence - last_->sequence);
  }
  last_ = Seen{timestamp, sequence};
}

std::optional<nanoseconds> FrameInterval::value() const {
  if (claimed_ && measured_) return std::max(*claimed_, *measured_);
  return claimed_ ? claimed_ : measured_;
}

}  // namespace skullstation
