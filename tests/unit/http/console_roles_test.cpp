// Every route times every role, against a table of its own, and every way past the door.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <regex>

#include "tests/unit/http/small_console.h"

namespace skullstation {
namespace {

using skullstation::testing::SmallConsole;
using ::testing::HasSubstr;

/// Who may: v(iewer) o(perator) e(xaminer) a(dministrator) u(auditor); * without signing in.
const std::map<std::string, std::string> expected = {
    {"GET /setup", "*"},
    {"POST /setup", "*"},
    {"POST /session", "*"},
    {"GET /openapi.json", "*"},
    {"GET /session", "voeau"},
    {"DELETE /session", "voeau"},
    {"PUT /session/password", "voeau"},
    {"GET /station", "voeau"},
    {"GET /station/scan", "voeau"},
    {"GET /station/preview", "voeau"},
    {"GET /station/check", "oeau"},
    {"POST /station/start", "oea"},
    {"POST /station/confirm", "oea"},
    {"POST /station/cancel", "oea"},
    {"POST /station/reset", "oea"},
    {"POST /station/hand", "oea"},
    {"GET /events", "voeau"},
    {"GET /cases", "voeau"},
    {"GET /cases/{case}", "voeau"},
    {"POST /cases/{case}/rerun", "e"},
    {"PUT /cases/{case}/hold", "e"},
    {"PUT /cases/{case}/priority", "ea"},
    {"POST /cases/{case}/approval", "e"},
    {"POST /jobs/{job}/retry", "oea"},
    {"POST /jobs/{job}/cancel", "ea"},
    {"POST /deliveries/{delivery}/retry", "oea"},
    {"POST /deliveries/{delivery}/hold", "ea"},
    {"GET /jobs/{job}/files", "voeau"},
    {"GET /jobs/{job}/files/{path*}", "voeau"},
    {"GET /accounts", "au"},
    {"POST /accounts", "a"},
    {"PATCH /accounts/{account}", "a"},
    {"GET /audit", "au"},
    {"GET /audit/check", "au"},
};

std::string address_of(const Route& route) {
  std::string path(route.path);
  path = std::regex_replace(path, std::regex(R"(\{path\*\})"), "a/b.txt");
  path = std::regex_replace(path, std::regex(R"(\{\w+\})"), "77");
  return "/api/v1" + path;
}

TEST(ConsoleRoles, EveryRouteTimesEveryRole) {
  SmallConsole small;
  const std::map<char, std::string> roles = {{'v', "viewer"},
                                             {'o', "operator"},
                                             {'e', "examiner"},
                                             {'a', "administrator"},
                                             {'u', "auditor"}};
  std::vector<Route> routes(api_routes().begin(), api_routes().end());
  // Whoever has signed out is no test of what comes after.
  std::ranges::stable_partition(routes,
                                [](const Route& route) { return route.method != "DELETE"; });
  for (const Route& route : routes) {
    const std::string name = std::string(route.method) + " " + std::string(route.path);
    ASSERT_TRUE(expected.contains(name)) << name << " is in no table: who may?";
    const std::string& may = expected.at(name);
    const auto ask = [&](const std::string& account) {
      return small.ask(std::string(route.method), address_of(route), account,
                       route.has_body ? "{}" : "");
    };
    const Response stranger = ask("");
    EXPECT_EQ(stranger.status == 401u, may != "*") << name << " without a sign-in";
    if (may == "*") continue;
    for (const auto& [letter, account] : roles) {
      const Response response = ask(account);
      const bool refused = response.body.find(R"("code":"role")") != std::string::npos;
      const std::string words = name + " as " + account + ": " + response.body;
      EXPECT_EQ(refused, may.find(letter) == std::string::npos) << words;
      EXPECT_EQ(refused, response.status == 403u) << words;
      EXPECT_NE(response.status, 401u) << words;
      EXPECT_NE(response.status, 500u) << words;
    }
  }
}

TEST(ConsoleRoles, TheTableKnowsEveryRoute) { EXPECT_EQ(api_routes().size(), expected.size()); }

/// Whatever changes something.
std::vector<Route> changing() {
  std::vector<Route> found;
  for (const Route& route : api_routes()) {
    if (route.method != "GET") found.push_back(route);
  }
  return found;
}

TEST(ConsoleDoor, WantsRequestsFromItsOwnPages) {
  SmallConsole small;
  for (const Route& route : changing()) {
    Request request = small.request(std::string(route.method), address_of(route), "examiner",
                                    route.has_body ? "{}" : "");
    const auto refused = [&] {
      const Response response = answer_request(small.console(), request);
      return response.status == 403 && response.body.find("\"origin\"") != std::string::npos;
    };
    const std::string name(route.path);
    request.headers["origin"] = "https://elsewhere";
    EXPECT_TRUE(refused()) << name;
    request.headers["origin"] = "http://station:8443";
    EXPECT_TRUE(refused()) << name;
    request.headers["origin"] = "null";
    EXPECT_TRUE(refused()) << name;
    request.headers.erase("origin");
    EXPECT_TRUE(refused()) << name;
    request.headers["sec-fetch-site"] = "cross-site";
    EXPECT_TRUE(refused()) << name;
    request.headers["sec-fetch-site"] = "same-origin";
    request.headers["origin"] = "https://elsewhere";
    EXPECT_TRUE(refused()) << name;
    request.headers["sec-fetch-site"] = "none";
    request.headers["origin"] = "https://station:8443";
    EXPECT_TRUE(refused()) << name;
  }
}

TEST(ConsoleDoor, WantsTheSessionsToken) {
  SmallConsole small;
  for (const Route& route : changing()) {
    if (route.roles == everybody) continue;
    Request request = small.request(std::string(route.method), address_of(route), "examiner",
                                    route.has_body ? "{}" : "");
    for (const std::string token : {"", "x", "00000000000000000000000000000000"}) {
      request.headers["x-csrf-token"] = token;
      const Response response = answer_request(small.console(), request);
      EXPECT_EQ(response.status, 403u) << route.path;
      EXPECT_THAT(response.body, HasSubstr("\"csrf\"")) << route.path;
    }
  }
}

TEST(ConsoleDoor, WantsTheRightKindOfBody) {
  SmallConsole small;
  for (const Route& route : changing()) {
    if (!route.has_body) continue;
    const std::string account =
        expected.at(std::string(route.method) + " " + std::string(route.path)) == "a"
            ? "administrator"
            : "examiner";
    Request request =
        small.request(std::string(route.method), address_of(route), account, R"({"x":1})");
    const auto status = [&] { return answer_request(small.console(), request).status; };
    EXPECT_EQ(status(), 422u) << route.path << ": a key that it does not know";
    for (const char* type :
         {"text/plain", "application/x-www-form-urlencoded", "", "application/jsonx"}) {
      request.headers["content-type"] = type;
      EXPECT_EQ(status(), 415u) << route.path << " " << type;
    }
    request.headers["content-type"] = "application/json; charset=utf-8";
    EXPECT_EQ(status(), 422u) << route.path;
    for (const char* body : {"", "[]", "1", "{", "{\"a\":1,\"a\":2}", "\xff", "{}{}", "null"}) {
      request.body = body;
      EXPECT_EQ(status(), 400u) << route.path << " " << body;
    }
    request.body = std::string(30000, '[');
    EXPECT_EQ(status(), 400u) << route.path << " nested deeply";
  }
}

TEST(ConsoleDoor, OfNothingAndOfTheWrongMethod) {
  SmallConsole small;
  EXPECT_EQ(small.ask("GET", "/api/v1").status, 404u);
  EXPECT_EQ(small.ask("GET", "/api/v1/nothing", "examiner").status, 404u);
  EXPECT_EQ(small.ask("GET", "/api/v1/cases/1/2/3", "examiner").status, 404u);
  EXPECT_EQ(small.ask("GET", "/api/v2/cases", "examiner").status, 404u);
  EXPECT_EQ(small.ask("GET", "/nothing").status, 404u);
  EXPECT_EQ(small.ask("POST", "/").status, 405u);
  const Response response = small.ask("PUT", "/api/v1/accounts", "administrator", "{}");
  EXPECT_EQ(response.status, 405u);
  EXPECT_EQ(response.headers.back().second, "GET, POST");
  EXPECT_EQ(small.ask("POST", "/api/v1/station/confirm", "operator", "{}").status, 400u)
      << "a body where none belongs";
}

TEST(ConsoleDoor, BeforeSetUpThereIsNothingElse) {
  SmallConsole small;
  skullstation::testing::TemporaryFolder folder(skullstation::testing::Medium::memory);
  const SystemClock clock;
  AccountOptions options;
  options.cost = {64, 1};
  const auto nobody = Accounts::open(folder / "console.db", clock, options);
  ASSERT_TRUE(nobody);
  bool told = false;
  Console fresh{small.service(),
                **nobody,
                small.console().approvals,
                small.console().audit,
                small.console().events,
                small.console().guesses,
                "AB:CD",
                "K7QD-M2XW-9RTA",
                [&told] { told = true; }};
  for (const Route& route : api_routes()) {
    if (route.path == "/setup") continue;
    const Response response =
        answer_request(fresh, small.request(std::string(route.method), address_of(route),
                                            "administrator", route.has_body ? "{}" : ""));
    EXPECT_EQ(response.status, 403u) << route.path;
    EXPECT_THAT(response.body, HasSubstr("setup_needed")) << route.path;
  }
  const auto set_up = [&](const std::string& code) {
    return answer_request(
        fresh, small.request("POST", "/api/v1/setup", "",
                             R"({"code":")" + code +
                                 R"(","name":"anna","password":"correct horse battery"})"));
  };
  EXPECT_EQ(set_up("").status, 403u);
  EXPECT_EQ(set_up("K7QD-M2XW-9RTB").status, 403u);
  EXPECT_FALSE(told);
  const Response done = set_up("K7QD-M2XW-9RTA");
  EXPECT_EQ(done.status, 201u) << done.body;
  EXPECT_TRUE(told);
  EXPECT_EQ(set_up("K7QD-M2XW-9RTA").status, 409u) << "once";
  EXPECT_THAT(small.audit_log(), HasSubstr("console: set up"));
}

TEST(ConsoleDoor, GuessesOfTheSetupCodeAreFew) {
  SmallConsole small;
  skullstation::testing::TemporaryFolder folder(skullstation::testing::Medium::memory);
  const SystemClock clock;
  const auto nobody = Accounts::open(folder / "console.db", clock, {{64, 1}});
  ASSERT_TRUE(nobody);
  Console fresh = small.console();
  Console unset{small.service(), **nobody,      fresh.approvals, fresh.audit,
                fresh.events,    fresh.guesses, "AB:CD",         "K7QD-M2XW-9RTA"};
  int looked_at = 0;
  for (int i = 0; i < 1000; ++i) {
    const Response response = answer_request(
        unset, small.request("POST", "/api/v1/setup", "",
                             R"({"code":"x","name":"anna","password":"correct horse battery"})"));
    if (response.status == 403) ++looked_at;
  }
  EXPECT_EQ(looked_at, 5);
}

}  // namespace
}  // namespace skullstation
