#pragma once

#include "core/clock.h"
#include "core/result.h"

namespace skullstation {

/// Priorities below the kernel's threaded interrupt handlers (50), which deliver the E-stop.
inline constexpr int stepping_priority = 40;
inline constexpr int interlock_priority = 45;

/// Gives the calling thread SCHED_FIFO at `priority` and locks what the process has in memory, so
/// that no page fault delays a step. Tries both; the error (kind hardware) tells what was refused
/// and how to allow it.
Result<void> make_this_thread_real_time(int priority);

/// Sleeps to the absolute deadline on CLOCK_MONOTONIC.
void sleep_exactly_until(Instant deadline);

}  // namespace skullstation
