// The whole console, from set-up to the first scan's refusal, over TLS.

#include "daemon/http/console_server.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/https_client.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using nlohmann::json;
using skullstation::testing::HttpsAnswer;
using skullstation::testing::HttpsClient;
using skullstation::testing::Medium;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

ServiceOptions options_in(const std::filesystem::path& folder) {
  ServiceOptions options;
  options.config.storage.folder = (folder / "store").string();
  options.config.evidence.keys_folder = (folder / "keys").string();
  options.config.evidence.audit_log = (folder / "audit.log").string();
  options.config.delivery.folder = (folder / "outbox").string();
  options.config.http.port = 0;
  options.config.http.address = "0.0.0.0";
  options.step_command = skullstation::testing::fake_step_command();
  return options;
}

TEST(ConsoleServer, IsSetUpSignedInAndListenedTo) {
  const TemporaryFolder folder(Medium::memory);
  const auto service = StationService::open(options_in(folder.path()));
  ASSERT_TRUE(service);
  const auto server = ConsoleServer::open(**service);
  ASSERT_TRUE(server) << server.error().message();
  const std::uint16_t port = (*server)->port();
  const std::string json_from_here =
      fmt::format("Origin: https://localhost:{}\r\nContent-Type: application/json\r\n", port);
  HttpsClient client(port);
  EXPECT_EQ(client.ask("GET", "/").status, 200);
  EXPECT_EQ(client.ask("GET", "/api/v1/station").status, 403);
  EXPECT_EQ(json::parse(client.ask("GET", "/api/v1/setup").body)["needed"], true);
  const HttpsAnswer made = client.ask(
      "POST", "/api/v1/setup", json_from_here,
      json{{"code", (*server)->setup_code()}, {"name", "anna"}, {"password", "correct horse"}}
          .dump());
  ASSERT_EQ(made.status, 201) << made.body;
  const std::string cookie = made.headers.at("set-cookie");
  const std::string signed_in = fmt::format("Cookie: {}\r\n", cookie.substr(0, cookie.find(';')));
  EXPECT_EQ(client.ask("GET", "/api/v1/station", signed_in).status, 200);
  EXPECT_EQ(client.ask("GET", "/api/v1/station").status, 401);

  HttpsClient listener(port);
  ASSERT_TRUE(listener.connected()) << "at its new address";
  listener.send("GET /api/v1/events HTTP/1.1\r\nHost: x\r\n" + signed_in + "\r\n");
  std::string told;
  while (told.find("\"state\":\"starting\"") == std::string::npos) {
    const std::string more = listener.receive();
    ASSERT_NE(more, "");
    told += more;
  }
  const std::string csrf = json::parse(made.body)["csrf"];
  const HttpsAnswer refused =
      client.ask("POST", "/api/v1/station/start",
                 json_from_here + signed_in + "X-CSRF-Token: " + csrf + "\r\n", "{}");
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("the station is starting"));
}

TEST(ConsoleServer, IsSetUpOnce) {
  const TemporaryFolder folder(Medium::memory);
  const auto service = StationService::open(options_in(folder.path()));
  ASSERT_TRUE(service);
  std::string fingerprint;
  {
    const auto server = ConsoleServer::open(**service);
    ASSERT_TRUE(server);
    EXPECT_EQ((*server)->setup_code().size(), 14u);
    fingerprint = (*server)->fingerprint();
    const SystemClock clock;
    const auto accounts = Accounts::open(folder / "store/console.db", clock, {{64, 1}});
    ASSERT_TRUE((*accounts)->add("anna", Role::administrator, "correct horse"));
  }
  const auto server = ConsoleServer::open(**service);
  ASSERT_TRUE(server);
  EXPECT_EQ((*server)->setup_code(), "");
  EXPECT_EQ((*server)->fingerprint(), fingerprint);
}

TEST(ConsoleServer, SaysWhatKeepsItFromStarting) {
  const TemporaryFolder folder(Medium::memory);
  ServiceOptions options = options_in(folder.path());
  options.config.http.certificate = "/nonexistent.pem";
  options.config.http.key = "/nonexistent.key";
  const auto service = StationService::open(options);
  ASSERT_TRUE(service);
  const auto server = ConsoleServer::open(**service);
  ASSERT_FALSE(server);
  EXPECT_THAT(server.error().message(), HasSubstr("/nonexistent.pem"));
}

}  // namespace
}  // namespace skullstation
