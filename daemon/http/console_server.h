#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "core/result.h"
#include "daemon/http/console.h"
#include "daemon/http/server.h"

namespace skullstation {

/// The console of a running station, at an address. Its accounts are console.db, its certificate
/// is tls/ in the storage folder; the audit log and its keys are where the configuration says.
class ConsoleServer {
 public:
  /// As long as there is no account it listens on this machine alone, and all it does is to let
  /// whoever knows the set-up code make one. Errors (bad_input): certificate, address, port, audit
  /// log's keys, database. The service must outlive it.
  static Result<std::unique_ptr<ConsoleServer>> open(StationService& service,
                                                     const ServerOptions& options = {});

  std::uint16_t port() const { return port_; }
  const std::string& fingerprint() const { return fingerprint_; }
  /// Empty once the station is set up.
  const std::string& setup_code() const { return setup_code_; }

 private:
  ConsoleServer() = default;

  std::unique_ptr<Accounts> accounts_;
  std::unique_ptr<Approvals> approvals_;
  std::unique_ptr<AuditTrail> audit_;
  std::unique_ptr<GuessLimit> guesses_;
  std::unique_ptr<EventHub> events_;
  std::unique_ptr<Console> console_;
  std::unique_ptr<HttpServer> server_;
  std::jthread mover_;  // to the configured address, once the station is set up
  std::uint16_t port_ = 0;
  std::string fingerprint_;
  std::string setup_code_;
};

}  // namespace skullstation
