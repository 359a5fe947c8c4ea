#include "capture/cameras/discarded_frames.h"

#include <fmt/format.h>

#include <string_view>

namespace skullstation {

std::string DiscardedFrames::text() const {
  std::string reasons;
  const auto add = [&reasons](int count, std::string_view what) {
    if (count == 0) return;
    reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", count, what);
  };
  add(old, "too old");
  add(settling, "taken while settings took effect");
  add(damaged, "damaged");
  if (reasons.empty()) return "none came";
  return last_damage.empty() ? reasons : fmt::format("{}; the last: {}", reasons, last_damage);
}

}  // namespace skullstation
