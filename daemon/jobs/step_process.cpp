#include "daemon/jobs/step_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <system_error>

#include "core/clock.h"
#include "core/file_descriptor.h"

namespace skullstation {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

namespace {

#if defined(__x86_64__)
constexpr std::uint32_t this_architecture = AUDIT_ARCH_X86_64;
constexpr std::uint32_t first_foreign_call = 0x40000000;  // x32 has its own numbers from here on
#elif defined(__aarch64__)
constexpr std::uint32_t this_architecture = AUDIT_ARCH_AARCH64;
constexpr std::uint32_t first_foreign_call = 0xffffffff;
#else
#error "which system calls this processor has is not known here"
#endif

constexpr sock_filter load(std::size_t offset) {
  return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset));
}
constexpr sock_filter jump(unsigned test, std::uint32_t value, std::uint8_t yes, std::uint8_t no) {
  return BPF_JUMP(static_cast<std::uint16_t>(BPF_JMP | test | BPF_K), value, yes, no);
}
constexpr sock_filter give(std::uint32_t verdict) { return BPF_STMT(BPF_RET | BPF_K, verdict); }

/// No network: sockets are local ones, and no other way makes them.
constexpr std::array network_filter{
    load(offsetof(seccomp_data, arch)),
    jump(BPF_JEQ, this_architecture, 1, 0),
    give(SECCOMP_RET_KILL_PROCESS),
    load(offsetof(seccomp_data, nr)),
    jump(BPF_JGE, first_foreign_call, 5, 0),
    jump(BPF_JEQ, SYS_io_uring_setup, 4, 0),
    jump(BPF_JEQ, SYS_socket, 0, 2),
    load(offsetof(seccomp_data, args)),
    jump(BPF_JEQ, AF_UNIX, 0, 1),
    give(SECCOMP_RET_ALLOW),
    give(SECCOMP_RET_ERRNO | EACCES),
};

void limit(decltype(RLIMIT_AS) what, std::uint64_t value) {
  const rlimit both{value, value};
  ::setrlimit(what, &both);
}

constexpr int lock_descriptor = 3;  // in the child

/// Everything that the child needs, made before the fork: after it only calls that are safe in a
/// copy of a process with threads.
struct Prepared {
  std::vector<std::string> words;
  std::vector<std::string> environment;
  std::vector<char*> argv;
  std::vector<char*> envp;
  std::string folder;
  pid_t parent = ::getpid();
  StepLimits limits;
  int lock = -1;
  int output = -1;  // write end of the pipe
  int log = -1;
  int nothing = -1;  // /dev/null
};

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> list;
  list.reserve(words.size() + 1);
  for (std::string& word : words) list.push_back(word.data());
  list.push_back(nullptr);
  return list;
}

[[noreturn]] void become_step(const Prepared& prepared) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != prepared.parent) ::_exit(127);  // it died before that took hold
  ::dup2(prepared.nothing, STDIN_FILENO);
  ::dup2(prepared.output, STDOUT_FILENO);
  ::dup2(prepared.log, STDERR_FILENO);
  ::dup2(prepared.lock, lock_descriptor);
  ::fcntl(lock_descriptor, F_SETFD, 0);  // dup2 onto itself would leave it to be closed
  ::syscall(SYS_close_range, lock_descriptor + 1, ~0U, 0);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  limit(RLIMIT_AS, prepared.limits.memory_bytes);
  limit(RLIMIT_FSIZE, prepared.limits.file_bytes);
  limit(RLIMIT_CORE, 0);
  const auto cpu = static_cast<std::uint64_t>(prepared.limits.cpu_time.count());
  const rlimit cpu_limit{cpu, cpu + 5};  // SIGXCPU, later SIGKILL
  ::setrlimit(RLIMIT_CPU, &cpu_limit);
  ::setpriority(PRIO_PROCESS, 0, 10);
  if (const int score = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC); score >= 0) {
    static_cast<void>(!::write(score, "500", 3));
    ::close(score);
  }
  if (::chdir(prepared.folder.c_str()) != 0) ::_exit(127);
  const sock_fprog filter{network_filter.size(), const_cast<sock_filter*>(network_filter.data())};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      (!prepared.limits.network && ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0)) {
    ::_exit(126);
  }
  ::execve(prepared.argv[0], prepared.argv.data(), prepared.envp.data());
  ::_exit(127);
}

tl::unexpected<Error> cannot(const std::string& what) {
  return fail(ErrorKind::bad_input, what,
              fmt::format("can't be used ({})", std::system_category().message(errno)));
}

/// Waits until no process of an earlier step has the lock any more.
Result<void> take_lock(int descriptor, const std::filesystem::path& file,
                       const std::stop_token& stop) {
  while (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return cannot(file.string());
    if (stop.stop_requested()) {
      return fail(ErrorKind::cancelled, file.string(), "stopped while an older step still ran");
    }
    SystemClock().sleep_for(50ms, stop);
  }
  return {};
}

/// Cuts what comes through the pipe into lines; one that is too long is none of ours.
class LineReader {
 public:
  LineReader(int descriptor, const std::function<void(std::string_view)>& on_line)
      : descriptor_(descriptor), on_line_(on_line) {}

  /// Reads what is there; false at the end.
  bool read() {
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    if (count == 0) return false;
    for (const char c : std::string_view(bytes.data(), static_cast<std::size_t>(count))) {
      if (c == '\n') {
        on_line_(line_);
        line_.clear();
      } else if (line_.size() < 4096) {
        line_ += c;
      }
    }
    return true;
  }

 private:
  const int descriptor_;
  const std::function<void(std::string_view)>& on_line_;
  std::string line_;
};

/// Follows the child until it has ended; ends it when asked to or when its time is over.
StepEnd follow(pid_t child, int output, const StepProcess& process, const std::stop_token& stop) {
  const auto begun = steady_clock::now();
  const auto deadline = begun + process.limits.time;
  LineReader lines(output, process.on_line);
  std::optional<steady_clock::time_point> kill_at;
  StepEnd end;
  bool talking = true;
  siginfo_t ended{};
  for (;;) {
    const auto now = steady_clock::now();
    if (!kill_at && (stop.stop_requested() || now >= deadline)) {
      end.how = stop.stop_requested() ? StepEnd::How::stopped : StepEnd::How::out_of_time;
      ::kill(-child, SIGTERM);
      kill_at = now + process.grace;
    }
    if (kill_at && now >= *kill_at) ::kill(-child, SIGKILL);
    if (talking) {
      pollfd waiting{output, POLLIN, 0};
      if (::poll(&waiting, 1, 50) > 0) talking = lines.read();
    } else {
      SystemClock().sleep_for(10ms, {});
    }
    // It stays a zombie for now, so that its number can't be another's when its group is ended.
    ended.si_pid = 0;
    if (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
        ended.si_pid == child) {
      break;
    }
  }
  ::kill(-child, SIGKILL);  // what it started and left behind
  while (talking) {
    pollfd waiting{output, POLLIN, 0};
    talking = ::poll(&waiting, 1, 0) > 0 && lines.read();
  }
  rusage used{};
  int status = 0;
  while (::wait4(child, &status, 0, &used) < 0 && errno == EINTR) {
  }
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  end.seconds = std::chrono::duration<double>(steady_clock::now() - begun).count();
  end.cpu_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
  end.peak_mib = static_cast<double>(used.ru_maxrss) / 1024.0;
  if (end.how != StepEnd::How::exited) return end;
  end.how = WIFEXITED(status) ? StepEnd::How::exited : StepEnd::How::signalled;
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
  return end;
}

}  // namespace

Result<StepEnd> run_step_process(const StepProcess& process, const std::stop_token& stop) {
  Prepared prepared;
  prepared.words = process.command;
  prepared.environment = {"PATH=/usr/local/bin:/usr/bin:/bin", "LANG=C.UTF-8",
                          "HOME=" + process.folder.string(), "TMPDIR=" + process.folder.string()};
  prepared.argv = pointers(prepared.words);
  prepared.envp = pointers(prepared.environment);
  prepared.folder = process.folder.string();
  prepared.limits = process.limits;
  if (::access(prepared.argv[0], X_OK) != 0) return cannot(process.command.front());

  FileDescriptor lock(::open(process.lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (lock.get() < 0) return cannot(process.lock.string());
  if (auto taken = take_lock(lock.get(), process.lock, stop); !taken) return forward(taken);
  const FileDescriptor nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  const FileDescriptor log(
      ::open(process.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (log.get() < 0) return cannot(process.log.string());
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return cannot("a pipe");
  const FileDescriptor output(pipe[0]);
  FileDescriptor input(pipe[1]);
  ::fcntl(output.get(), F_SETFL, O_NONBLOCK);
  prepared.lock = lock.get();
  prepared.output = input.get();
  prepared.log = log.get();
  prepared.nothing = nothing.get();

  const pid_t child = ::fork();
  if (child < 0) return cannot("a new process");
  if (child == 0) become_step(prepared);
  ::setpgid(child, child);  // whichever of both comes first
  input.close();
  lock.close();  // the child has it now
  return follow(child, output.get(), process, stop);
}

std::string end_in_words(const StepEnd& end, const StepLimits& limits) {
  const double gib = static_cast<double>(limits.memory_bytes) / static_cast<double>(1U << 30U);
  switch (end.how) {
    case StepEnd::How::stopped: return "was stopped";
    case StepEnd::How::out_of_time:
      return fmt::format("was ended: it took longer than {} min",
                         std::chrono::ceil<std::chrono::minutes>(limits.time).count());
    case StepEnd::How::signalled:
      if (end.code == SIGXCPU) {
        return fmt::format("was ended: it used more than {} min of CPU time",
                           std::chrono::ceil<std::chrono::minutes>(limits.cpu_time).count());
      }
      if (end.code == SIGXFSZ) return "was ended: it wrote a file larger than it may";
      if (end.code == SIGKILL) return "was killed, probably because the machine ran out of memory";
      return fmt::format("crashed: signal {} ({})", end.code, ::strsignal(end.code));
    case StepEnd::How::exited: break;
  }
  if (end.code == 0) return {};
  if (end.code == 126) return "can't be kept off the network: the kernel has no seccomp";
  if (end.code == 127) return "can't be started";
  return fmt::format("ended with code {} (it may use {:.1f} GiB of memory)", end.code, gib);
}

}  // namespace skullstation
