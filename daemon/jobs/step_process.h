#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "daemon/jobs/step_chain.h"

namespace skullstation {

/// How a step's process ended and what it used.
struct StepEnd {
  enum class How { exited, signalled, out_of_time, stopped };
  How how = How::exited;
  int code = 0;  ///< exit code, or the signal's number
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  double peak_mib = 0.0;  ///< of resident memory
};

struct StepProcess {
  std::vector<std::string> command;  ///< the first word is the program's path
  std::filesystem::path folder;      ///< working folder; TMPDIR, too
  std::filesystem::path log;         ///< what it prints on stderr
  StepLimits limits;
  /// Held by the process and all its children for as long as one of them lives.
  std::filesystem::path lock;
  /// From SIGTERM to SIGKILL, when it is stopped or out of time.
  std::chrono::milliseconds grace{5000};
  /// Each line of its stdout.
  std::function<void(std::string_view)> on_line = [](std::string_view) {};
};

/// Runs a step to its end in a process of its own, which
/// - has no network (seccomp: no sockets but local ones; no io_uring), unless the limits give it,
/// - can't gain privileges,
/// - has the limits' memory (RLIMIT_AS), CPU time (RLIMIT_CPU), file size and time,
/// - yields to the scanner (nice 10) and is the first to go when memory runs out,
/// - dies with this process, and whatever it started goes with it.
/// Call it from a thread that lives until it returns. Errors: the program can't be started, or the
/// lock is held by a step that outlived an earlier process (cancelled if stopped while waiting).
Result<StepEnd> run_step_process(const StepProcess& process, const std::stop_token& stop);

/// "ended by signal 11 (Segmentation fault)"; empty if it exited with code 0.
std::string end_in_words(const StepEnd& end, const StepLimits& limits);

}  // namespace skullstation
