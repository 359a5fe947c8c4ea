#pragma once

#include <sys/resource.h>

#include <chrono>
#include <ctime>

namespace skullstation {

/// Wall and processor time: the latter is what counts on a busy machine.
struct Seconds {
  double wall = 0.0;
  double processor = 0.0;

  static Seconds now() {
    timespec used{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    const auto wall_time = std::chrono::steady_clock::now().time_since_epoch();
    return {std::chrono::duration<double>(wall_time).count(),
            static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec)};
  }
  Seconds operator-(const Seconds& o) const { return {wall - o.wall, processor - o.processor}; }
  Seconds operator+(const Seconds& o) const { return {wall + o.wall, processor + o.processor}; }
  Seconds operator*(double f) const { return {wall * f, processor * f}; }
};

/// The most memory that the process had so far.
inline double peak_memory_gib() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);
}

}  // namespace skullstation
