#pragma once

#include <filesystem>
#include <memory>
#include <thread>

#include "daemon/delivery/delivery.h"

namespace skullstation {

/// Sends what is due, on a thread of its own, every ten seconds until its end; a transfer that is
/// under way is then interrupted and goes on at the next start.
class OutboxLoop {
 public:
  /// Opens the outbox, makes it where there is none.
  static Result<std::unique_ptr<OutboxLoop>> start(const std::filesystem::path& folder,
                                                   SenderOptions options);

 private:
  OutboxLoop(std::unique_ptr<Outbox> outbox, SenderOptions options);
  void run(const std::stop_token& stop);

  std::unique_ptr<Outbox> outbox_;
  SenderOptions options_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace skullstation
