#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/session/strict_json.h"
#include "daemon/http/accounts.h"
#include "daemon/http/approvals.h"
#include "daemon/http/audit_trail.h"
#include "daemon/http/event_hub.h"
#include "daemon/http/limits.h"
#include "daemon/http/message.h"
#include "daemon/service/station_service.h"

namespace skullstation {

/// What the console's answers are made of.
struct Console {
  StationService& service;
  Accounts& accounts;
  Approvals& approvals;
  const AuditTrail& audit;
  EventHub& events;
  GuessLimit& guesses;
  std::string fingerprint;  ///< of the certificate
  std::string setup_code;   ///< asked for as long as there is no account
  std::function<void()> on_set_up = [] {};
};

/// One request on its way through its route.
struct Call {
  const Request& request;
  std::map<std::string, std::string> parts;  ///< of the path: {case}
  SignIn who;                                ///< nobody on open routes
  std::string token;
  JsonFaults faults{"the request's body"};
  nlohmann::json body = nlohmann::json::object();
  std::string subject = {};  ///< case number, for the audit log
  nlohmann::ordered_json details = nlohmann::ordered_json::object();  ///< for the audit log

  /// {case}, {job}: -1 if it is no number.
  std::int64_t number(const std::string& part) const;
  /// 422 if the body has a fault.
  std::optional<Response> faulty() const;
};

/// Which roles a route is for, as a sum of bits; `everybody` needs no sign-in.
using Roles = unsigned;
constexpr Roles bit(Role role) { return 1U << static_cast<unsigned>(role); }
inline constexpr Roles everybody = 1U << 31;

struct Route {
  std::string_view method;
  std::string_view path;  ///< below /api/v1; {name} is a part, {name*} all that is left
  Roles roles;
  bool has_body;           ///< a JSON object
  std::string_view audit;  ///< what the audit log calls it; empty: it is not written there
  Response (*action)(Console&, Call&);
};

/// Every route of the API; daemon/http/openapi.json describes them.
std::span<const Route> api_routes();

/// The values of the pattern's parts, if the path has its form.
std::optional<std::map<std::string, std::string>> match_route(std::string_view pattern,
                                                              std::string_view path);

/// Answers: the API below /api/v1, the embedded pages elsewhere.
Response answer_request(Console& console, const Request& request);

inline constexpr std::string_view session_cookie = "__Host-skullstation";

}  // namespace skullstation
