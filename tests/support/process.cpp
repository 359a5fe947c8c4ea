#include "tests/support/process.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "core/file.h"

namespace skullstation::testing {

Process::Process(const std::vector<std::string>& command) {
  std::string name = (std::filesystem::temp_directory_path() / "skullstation-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder: " + name);
  folder_ = name;
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::string out = (folder_ / "out").string();
  const std::string err = (folder_ / "err").string();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
}

Process::~Process() {
  if (!ended_) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

void Process::send(int signal) {
  if (!ended_) ::kill(pid_, signal);
}

bool Process::wait_for(std::chrono::milliseconds time) {
  const auto deadline = std::chrono::steady_clock::now() + time;
  int status = 0;
  while (!ended_) {
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      take_status(status);
    } else if (std::chrono::steady_clock::now() >= deadline) {
      return false;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  return true;
}

ProcessResult Process::wait() {
  int status = 0;
  if (!ended_ && ::waitpid(pid_, &status, 0) == pid_) take_status(status);
  return {exit_code_, read_file(folder_ / "out").value_or(""), err_so_far()};
}

std::string Process::err_so_far() const { return read_file(folder_ / "err").value_or(""); }

void Process::take_status(int status) {
  ended_ = true;
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::filesystem::path skullstation_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "skullstation";
}

ProcessResult skullstation_cli(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), skullstation_program().string());
  return Process(arguments).wait();
}

}  // namespace skullstation::testing
