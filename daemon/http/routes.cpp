#include <array>

#include "daemon/http/actions.h"

namespace skullstation {

namespace {

using namespace actions;

constexpr Roles viewer = bit(Role::viewer);
constexpr Roles operates = bit(Role::operates);
constexpr Roles examiner = bit(Role::examiner);
constexpr Roles administrator = bit(Role::administrator);
constexpr Roles auditor = bit(Role::auditor);

constexpr Roles signed_in = viewer | operates | examiner | administrator | auditor;
/// At the table: whoever may make the platter turn.
constexpr Roles hands = operates | examiner | administrator;

constexpr std::array routes{
    Route{"GET", "/setup", everybody, false, "", setup_state},
    Route{"POST", "/setup", everybody, true, "set up", set_up},
    Route{"POST", "/session", everybody, true, "sign in", sign_in},
    Route{"GET", "/session", signed_in, false, "", who_am_i},
    Route{"DELETE", "/session", signed_in, false, "sign out", sign_out},
    Route{"PUT", "/session/password", signed_in, true, "change password", change_password},

    Route{"GET", "/station", signed_in, false, "", station},
    Route{"GET", "/station/scan", signed_in, false, "", scan_views},
    Route{"GET", "/station/preview", signed_in, false, "", preview},
    Route{"GET", "/station/check", hands | auditor, false, "", check},
    Route{"POST", "/station/start", hands, true, "start scan", start},
    Route{"POST", "/station/confirm", hands, false, "confirm placement", confirm},
    Route{"POST", "/station/cancel", hands, false, "cancel scan", cancel},
    Route{"POST", "/station/reset", hands, false, "reset station", reset},
    Route{"POST", "/station/hand", hands, true, "simulated hand", hand},
    Route{"GET", "/events", signed_in, false, "", events},

    Route{"GET", "/cases", signed_in, false, "", cases},
    Route{"GET", "/cases/{case}", signed_in, false, "", show_case},
    Route{"POST", "/cases/{case}/rerun", examiner, true, "rerun step", rerun},
    Route{"PUT", "/cases/{case}/hold", examiner, true, "hold case", hold},
    Route{"PUT", "/cases/{case}/priority", examiner | administrator, true, "prioritise case",
          prioritise},
    Route{"POST", "/cases/{case}/approval", examiner, true, "approve case", approve},
    Route{"POST", "/jobs/{job}/retry", hands, false, "retry job", retry},
    Route{"POST", "/jobs/{job}/cancel", examiner | administrator, false, "cancel job", cancel_job},
    Route{"POST", "/deliveries/{delivery}/retry", hands, false, "retry delivery", retry_delivery},
    Route{"POST", "/deliveries/{delivery}/hold", examiner | administrator, false, "hold delivery",
          hold_delivery},
    Route{"GET", "/jobs/{job}/files", signed_in, false, "", files},
    Route{"GET", "/jobs/{job}/files/{path*}", signed_in, false, "", file},

    Route{"GET", "/accounts", administrator | auditor, false, "", accounts},
    Route{"POST", "/accounts", administrator, true, "add account", add_account},
    Route{"PATCH", "/accounts/{account}", administrator, true, "change account", change_account},
    Route{"GET", "/audit", auditor | administrator, false, "", audit},
    Route{"GET", "/audit/check", auditor | administrator, false, "", audit_check},
    Route{"GET", "/openapi.json", everybody, false, "", description},
};

}  // namespace

std::span<const Route> api_routes() { return routes; }

std::optional<std::map<std::string, std::string>> match_route(std::string_view pattern,
                                                              std::string_view path) {
  std::map<std::string, std::string> parts;
  while (!pattern.empty()) {
    const std::string_view wanted = pattern.substr(1, pattern.find('/', 1) - 1);
    if (path.empty() || path[0] != '/') return std::nullopt;
    if (wanted.starts_with('{') && wanted.ends_with("*}")) {
      if (path.size() < 2) return std::nullopt;
      parts[std::string(wanted.substr(1, wanted.size() - 3))] = path.substr(1);
      return parts;
    }
    const std::string_view given = path.substr(1, path.find('/', 1) - 1);
    if (given.empty()) return std::nullopt;
    if (wanted.starts_with('{')) {
      parts[std::string(wanted.substr(1, wanted.size() - 2))] = given;
    } else if (wanted != given) {
      return std::nullopt;
    }
    pattern.remove_prefix(wanted.size() + 1);
    path.remove_prefix(given.size() + 1);
  }
  if (!path.empty()) return std::nullopt;
  return parts;
}

}  // namespace skullstation
