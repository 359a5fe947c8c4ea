#pragma once

#include <memory>
#include <string>

#include "daemon/http/console.h"
#include "tests/support/temporary_folder.h"

namespace skullstation::testing {

/// A console without its server, on a station that is not open, with an account of each role:
/// "viewer", "operator", … and the password `password`.
class SmallConsole {
 public:
  SmallConsole();

  StationService& service() { return *service_; }
  Console& console() { return *console_; }
  std::string audit_log() const;

  /// Signed in from a page of the console; nobody: without a cookie.
  Request request(const std::string& method, const std::string& target,
                  const std::string& account = "", const std::string& body = "");
  Response ask(const std::string& method, const std::string& target,
               const std::string& account = "", const std::string& body = "");

  static constexpr auto password = "correct horse battery";

 private:
  TemporaryFolder folder_{Medium::memory};
  SystemClock clock_;
  std::unique_ptr<StationService> service_;
  std::unique_ptr<Accounts> accounts_;
  std::unique_ptr<Approvals> approvals_;
  std::unique_ptr<AuditTrail> audit_;
  std::unique_ptr<GuessLimit> guesses_;
  std::unique_ptr<EventHub> events_;
  std::unique_ptr<Console> console_;
  std::map<std::string, NewSignIn> held_;
};

}  // namespace skullstation::testing
