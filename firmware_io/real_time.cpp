#include "firmware_io/real_time.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <chrono>
#include <ctime>
#include <system_error>

namespace skullstation {

Result<void> make_this_thread_real_time(int priority) {
  const int lock_failure = ::mlockall(MCL_CURRENT | MCL_ONFAULT) == 0 ? 0 : errno;
  const sched_param parameters{.sched_priority = priority};
  const int failure = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);
  const auto reason = [](int error_number) { return std::system_category().message(error_number); };
  if (failure != 0) {
    return fail(ErrorKind::hardware, "stepping",
                "runs without real-time priority (" + reason(failure) + ")",
                "allow it by LimitRTPRIO=50 (docs/hardware.md)");
  }
  if (lock_failure != 0) {
    return fail(ErrorKind::hardware, "stepping",
                "its memory is not locked (" + reason(lock_failure) + ")",
                "allow it by LimitMEMLOCK=infinity (docs/hardware.md)");
  }
  return {};
}

void sleep_exactly_until(Instant deadline) {
  const auto since_boot = deadline.time_since_epoch();
  const auto whole = std::chrono::floor<std::chrono::seconds>(since_boot);
  timespec until{};
  until.tv_sec = whole.count();
  until.tv_nsec = std::chrono::nanoseconds(since_boot - whole).count();
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace skullstation
