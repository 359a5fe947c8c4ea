#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "core/clock.h"

namespace skullstation {

/// One line of the kernel's trace: somebody set or read a GPIO line, or a test left a mark.
struct TraceEvent {
  enum class Kind { set, get, mark };
  Kind kind = Kind::mark;
  Instant at;     ///< kernel time stamp, CLOCK_MONOTONIC
  int line = 0;   ///< global number
  int level = 0;  ///< set or read
  std::string mark;
};

/// Records what the kernel sees at its GPIO lines (tracefs, event gpio:gpio_value), from
/// construction to destruction: the lab's witness, independent of the code under test.
class GpioTrace {
 public:
  GpioTrace();
  ~GpioTrace();
  GpioTrace(const GpioTrace&) = delete;
  GpioTrace& operator=(const GpioTrace&) = delete;

  /// Puts a mark into the record, stamped by the kernel.
  void mark(const std::string& text);

  /// All so far, in order of time. Throws if the kernel had to drop any.
  std::vector<TraceEvent> events() const;
};

/// Times at which the line was set from low to high, in order.
std::vector<Instant> rising_edges(const std::vector<TraceEvent>& events, int line);

}  // namespace skullstation
