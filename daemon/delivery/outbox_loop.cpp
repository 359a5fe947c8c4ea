#include "daemon/delivery/outbox_loop.h"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace skullstation {

using namespace std::chrono_literals;

OutboxLoop::OutboxLoop(Outbox& outbox, SenderOptions options, std::function<Result<void>()> take_in)
    : outbox_(outbox),
      options_(std::move(options)),
      take_in_(std::move(take_in)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

/// What cannot be taken in does not keep the rest from being sent.
Result<void> OutboxLoop::once(const Progress& progress) {
  auto taken = take_in_();
  const auto sent = send_due(outbox_, options_, SystemClock(), progress);
  if (!sent) return forward(sent);
  if (!taken) return taken;
  return take_in_();
}

void OutboxLoop::run(const std::stop_token& stop) {
  Progress progress;
  progress.stop = stop;
  std::string told;  // a fault that stays is told once
  do {
    const auto done = once(progress);
    const std::string fault =
        done || done.error().kind == ErrorKind::cancelled ? "" : done.error().message();
    if (fault != told && !fault.empty()) fmt::print(stderr, "outbox: {}\n", fault);
    told = fault;
  } while (SystemClock().sleep_for(1s, stop));
}

}  // namespace skullstation
