#include "daemon/delivery/outbox_loop.h"

#include <fmt/format.h>

namespace skullstation {

namespace {

using namespace std::chrono_literals;

const SystemClock& system_clock() {
  static const SystemClock clock;
  return clock;
}

}  // namespace

OutboxLoop::OutboxLoop(std::unique_ptr<Outbox> outbox, SenderOptions options)
    : outbox_(std::move(outbox)),
      options_(std::move(options)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

Result<std::unique_ptr<OutboxLoop>> OutboxLoop::start(const std::filesystem::path& folder,
                                                      SenderOptions options) {
  auto outbox = Outbox::open(folder, system_clock());
  if (!outbox) return forward(outbox);
  return std::unique_ptr<OutboxLoop>(new OutboxLoop(*std::move(outbox), std::move(options)));
}

void OutboxLoop::run(const std::stop_token& stop) {
  Progress progress;
  progress.stop = stop;
  std::string told;  // a fault that stays is told once
  do {
    const auto sent = send_due(*outbox_, options_, system_clock(), progress);
    const std::string fault =
        sent || sent.error().kind == ErrorKind::cancelled ? "" : sent.error().message();
    if (fault != told && !fault.empty()) fmt::print(stderr, "outbox: {}\n", fault);
    told = fault;
  } while (SystemClock().sleep_for(10s, stop));
}

}  // namespace skullstation
