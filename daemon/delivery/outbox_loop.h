#pragma once

#include <functional>
#include <thread>

#include "daemon/delivery/delivery.h"

namespace skullstation {

/// Sends what is due, on a thread of its own, every second until its end; a transfer that is under
/// way is then interrupted and goes on at the next start.
class OutboxLoop {
 public:
  /// `take_in` is called before and after each sending: what else has to go in, what has arrived.
  OutboxLoop(Outbox& outbox, SenderOptions options, std::function<Result<void>()> take_in);

 private:
  void run(const std::stop_token& stop);
  Result<void> once(const Progress& progress);

  Outbox& outbox_;
  SenderOptions options_;
  std::function<Result<void>()> take_in_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace skullstation
