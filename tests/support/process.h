#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace skullstation::testing {

struct ProcessResult {
  int exit_code = -1;  ///< 128 + signal where one ended it
  std::string out;
  std::string err;
};

/// A child process with its output in files; killed, if it still runs, at the end of the scope.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal);
  /// True as soon as it has ended, false after the time.
  bool wait_for(std::chrono::milliseconds time);
  ProcessResult wait();
  /// What it has written to stderr so far.
  std::string err_so_far() const;

 private:
  void take_status(int status);

  std::filesystem::path folder_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
  bool ended_ = false;
};

/// Runs the `skullstation` program of this build with the arguments.
ProcessResult skullstation_cli(std::vector<std::string> arguments);
std::filesystem::path skullstation_program();

}  // namespace skullstation::testing
