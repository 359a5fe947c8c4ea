#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/clock.h"

namespace skullstation {

/// One line of the kernel's trace.
struct TraceEvent {
  Instant at;        ///< kernel time stamp, CLOCK_MONOTONIC, to the microsecond
  std::string name;  ///< "gpio_value"; "tracing_mark_write" for a test's own mark
  std::string text;  ///< "992 set 1"
};

/// Records one of the kernel's events (tracefs), from construction to destruction: the lab's
/// witness, independent of the code under test. One at a time.
class KernelTrace {
 public:
  /// "gpio/gpio_value": somebody sets or reads a GPIO line.
  /// "v4l2/v4l2_dqbuf": somebody takes a buffer from a camera.
  explicit KernelTrace(const std::string& event);
  ~KernelTrace();
  KernelTrace(const KernelTrace&) = delete;
  KernelTrace& operator=(const KernelTrace&) = delete;

  /// Puts a mark into the record, stamped by the kernel.
  void mark(const std::string& text);

  /// All so far, in order of time. Throws std::runtime_error if the kernel had to drop any.
  std::vector<TraceEvent> events() const;
};

/// The kernel's events while they happen, for whoever has to answer them: takes them out of the
/// record, so not beside a KernelTrace.
class LiveKernelTrace {
 public:
  explicit LiveKernelTrace(const std::string& event);
  ~LiveKernelTrace();
  LiveKernelTrace(const LiveKernelTrace&) = delete;
  LiveKernelTrace& operator=(const LiveKernelTrace&) = delete;

  /// What has happened since the last call; waits for it, but no longer than this.
  std::vector<TraceEvent> next(std::chrono::milliseconds timeout);

 private:
  int pipe_;
  std::string rest_;  ///< an event that has not come whole yet
};

/// A GPIO line as it was driven by software.
struct LineChange {
  Instant at;
  bool high = false;
};

/// The changes of level (not the repeated settings of the same) that software made to the line, in
/// order; a line is low before.
std::vector<LineChange> changes_of_line(const std::vector<TraceEvent>& events, int global_number);

/// When the line went from low to high, in order.
std::vector<Instant> rising_edges(const std::vector<TraceEvent>& events, int global_number);

/// When the mark was made. Throws std::out_of_range if it is not there.
Instant time_of_mark(const std::vector<TraceEvent>& events, const std::string& mark);

/// Sequence numbers of the buffers that a camera's driver gave out flagged as damaged.
std::vector<std::uint32_t> damaged_buffers(const std::vector<TraceEvent>& events);

}  // namespace skullstation
