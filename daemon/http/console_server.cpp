#include "daemon/http/console_server.h"

#include <fmt/format.h>

#include <cstdio>

namespace skullstation {

namespace {

constexpr auto this_machine = "127.0.0.1";

}  // namespace

Result<std::unique_ptr<ConsoleServer>> ConsoleServer::open(StationService& service,
                                                           const ServerOptions& options) {
  const StationConfig& config = service.config();
  const std::filesystem::path storage = config.storage.folder;
  const Clock& clock = service.clock();
  std::unique_ptr<ConsoleServer> server(new ConsoleServer);

  AccountOptions account_options;
  account_options.idle = std::chrono::minutes(config.http.idle_min);
  account_options.longest = std::chrono::hours(config.http.sign_in_hours);
  auto accounts = Accounts::open(storage / "console.db", clock, account_options);
  if (!accounts) return forward(accounts);
  server->accounts_ = *std::move(accounts);
  auto approvals = Approvals::open(storage / "console.db", clock);
  if (!approvals) return forward(approvals);
  server->approvals_ = *std::move(approvals);
  if (auto sealed = seal_approved(*server->approvals_, service); !sealed) return forward(sealed);

  auto keys = keys_in(config.evidence.keys_folder, config.station_id, clock);
  if (!keys) return forward(keys);
  server->audit_ = std::make_unique<AuditTrail>(
      AuditTrail{{config.evidence.audit_log, config.station_id}, *std::move(keys), clock});

  const auto certificate = config.http.certificate.empty()
                               ? own_certificate(storage / "tls", clock)
                               : read_certificate(config.http.certificate, config.http.key);
  if (!certificate) return forward(certificate);
  server->fingerprint_ = certificate->fingerprint;

  const auto none = server->accounts_->none();
  if (!none) return forward(none);
  if (*none) server->setup_code_ = random_code();
  server->guesses_ = std::make_unique<GuessLimit>(clock);
  server->events_ = std::make_unique<EventHub>(service, *server->accounts_);
  server->console_ = std::make_unique<Console>(
      Console{service, *server->accounts_, *server->approvals_, *server->audit_, *server->events_,
              *server->guesses_, server->fingerprint_, server->setup_code_});
  auto https = HttpServer::start(*certificate, options,
                                 [console = server->console_.get()](const Request& request) {
                                   return answer_request(*console, request);
                                 });
  if (!https) return forward(https);
  server->server_ = *std::move(https);
  const std::string address = config.http.address;
  const auto port = server->server_->listen(*none ? this_machine : address,
                                            static_cast<std::uint16_t>(config.http.port));
  if (!port) return forward(port);
  server->port_ = *port;
  if (*none && address != this_machine) {
    server->console_->on_set_up = [raw = server.get(), address] {
      // Not by the worker that answers: it waits for the thread that moves bytes.
      raw->mover_ = std::jthread([raw, address] {
        if (const auto moved = raw->server_->listen(address, raw->port_); !moved) {
          fmt::print(stderr, "{}\n", moved.error().message());
        }
      });
    };
  }
  return server;
}

}  // namespace skullstation
