#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "core/progress.h"
#include "core/result.h"

namespace skullstation {

/// The flags that every command has.
struct CommonOptions {
  bool json = false;  ///< one JSON object with the figures on stdout
  int threads = 0;    ///< 0: all
  std::uint64_t seed = 1;
};

/// What a command has to say: for a person, and the same figures as one JSON object.
struct CommandReport {
  std::string text;
  std::string json;
  int exit_code = 0;  ///< not 0: the command did its work, and what it found is bad
};

/// Progress on stderr: a bar with the remaining time on a terminal, a line every tenth elsewhere.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();  ///< ends the line
  Progress progress(std::stop_token stop);

 private:
  void show(double fraction, std::string_view stage);

  std::mutex mutex_;
  const bool on_terminal_;
  const std::chrono::steady_clock::time_point start_;
  int shown_permille_ = -1;
  std::string shown_stage_;
};

/// Turns the first SIGINT or SIGTERM into a stop request; a second one ends the process at once.
/// Make it before any other thread, so that all of them leave the signals to it.
class StopOnSignal {
 public:
  StopOnSignal();
  std::stop_token token() const { return stop_.get_token(); }

 private:
  std::stop_source stop_;
  std::jthread waiter_;
};

/// "1 min 20 s"
std::string to_words(std::chrono::seconds duration);

/// Control characters but for line feed and tab as '?': words and names that come out of files must
/// not steer the terminal.
std::string printable(std::string text);

/// Prints the report (stdout) or the error (stderr; with `json` an object on stdout too) and
/// returns the process's exit code.
int finish(const Result<CommandReport>& result, bool json);

/// Runs a program and returns its exit code: an exception that nobody expected is a message and 5.
int guarded(const char* program, const std::function<int()>& body) noexcept;

}  // namespace skullstation
