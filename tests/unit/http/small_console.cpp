#include "tests/unit/http/small_console.h"

#include <stdexcept>

#include "core/file.h"
#include "tests/support/steps.h"

namespace skullstation::testing {

namespace {

template <class T>
T taken(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return *std::move(result);
}

}  // namespace

SmallConsole::SmallConsole() {
  ServiceOptions options;
  options.config.storage.folder = (folder_ / "store").string();
  TargetConfig records;
  records.name = "records";
  TargetConfig closed;
  closed.name = "closed";
  closed.enabled = false;
  options.config.delivery.targets = {records, closed};
  options.config.delivery.folder = (folder_ / "outbox").string();
  options.step_command = fake_step_command();
  options.version = "1.2.3";
  service_ = taken(StationService::open(options));
  AccountOptions account_options;
  account_options.cost = {64, 1};
  accounts_ = taken(Accounts::open(folder_ / "console.db", clock_, account_options));
  for (const char* role : {"viewer", "operator", "examiner", "administrator", "auditor"}) {
    if (!accounts_->add(role, *role_named(role), password)) throw std::runtime_error(role);
    held_[role] = taken(accounts_->sign_in(role));
  }
  approvals_ = taken(Approvals::open(folder_ / "console.db", clock_));
  audit_ = std::make_unique<AuditTrail>(AuditTrail{
      {folder_ / "audit.log", "TEST"}, taken(keys_in(folder_ / "keys", "TEST", clock_)), clock_});
  guesses_ = std::make_unique<GuessLimit>(clock_);
  events_ = std::make_unique<EventHub>(*service_, *accounts_);
  console_ = std::make_unique<Console>(
      Console{*service_, *accounts_, *approvals_, *audit_, *events_, *guesses_, "AB:CD", "CODE"});
}

std::string SmallConsole::audit_log() const {
  return read_file(folder_ / "audit.log").value_or(std::string{});
}

Request SmallConsole::request(const std::string& method, const std::string& target,
                              const std::string& account, const std::string& body) {
  const auto parsed = parse_target(target);
  if (!parsed) throw std::runtime_error(target);
  Request request;
  request.method = method;
  request.path = parsed->path;
  request.query = parsed->query;
  request.peer = "192.0.2.1";
  request.body = body;
  request.headers = {{"host", "station:8443"}, {"origin", "https://station:8443"}};
  if (!body.empty()) request.headers["content-type"] = "application/json";
  if (!account.empty()) {
    request.headers["cookie"] = std::string(session_cookie) + "=" + held_.at(account).token;
    request.headers["x-csrf-token"] = held_.at(account).sign_in.csrf;
  }
  return request;
}

Response SmallConsole::ask(const std::string& method, const std::string& target,
                           const std::string& account, const std::string& body) {
  return answer_request(*console_, request(method, target, account, body));
}

}  // namespace skullstation::testing
