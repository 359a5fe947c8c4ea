#pragma once

#include <string>

namespace skullstation {

/// Why pictures were discarded while waiting for a good one.
struct DiscardedFrames {
  int old = 0;
  int settling = 0;
  int damaged = 0;
  std::string last_damage;

  /// "3 too old, 1 damaged; the last: ..." or "none came".
  std::string text() const;
};

}  // namespace skullstation
