#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/http/event_queue.h"
#include "daemon/service/sealed_cases.h"
#include "tests/support/station_client.h"
#include "tests/support/steps.h"
#include "tests/unit/http/small_console.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using skullstation::testing::comes_true;
using skullstation::testing::SmallConsole;
using ::testing::HasSubstr;
using ::testing::Not;

std::string header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return {};
}

class ConsoleApi : public ::testing::Test {
 protected:
  json get(const std::string& target, const std::string& account = "examiner") {
    const Response response = small_.ask("GET", "/api/v1" + target, account);
    EXPECT_EQ(response.status, 200u) << target << ": " << response.body;
    return json::parse(response.body);
  }
  Response send(const std::string& method, const std::string& target, const std::string& body = "",
                const std::string& account = "examiner") {
    return small_.ask(method, "/api/v1" + target, account, body);
  }
  /// A case whose steps fake_step has made.
  Case finished_case(const std::string& number) {
    StationService& service = small_.service();
    const auto scanned =
        skullstation::testing::scan_fake_case(service.store(), number, service.chain());
    EXPECT_TRUE(scanned);
    service.engine().wake();
    EXPECT_TRUE(comes_true(
        [&] { return service.store().case_of(scanned->id)->state != CaseState::building; }));
    return *scanned;
  }
  std::int64_t job_of(std::int64_t case_id, const std::string& step) {
    std::int64_t found = 0;
    const json whole = get(fmt::format("/cases/{}", case_id));
    for (const json& job : whole["jobs"]) {
      if (job["step"] == step) found = job["id"];
    }
    return found;
  }

  SmallConsole small_;
};

TEST_F(ConsoleApi, SignsInAndOut) {
  const Response in =
      send("POST", "/session", R"({"name":"operator","password":"correct horse battery"})", "");
  ASSERT_EQ(in.status, 201u);
  EXPECT_EQ(json::parse(in.body)["role"], "operator");
  const std::string cookie = header(in, "Set-Cookie");
  EXPECT_THAT(cookie, ::testing::StartsWith("__Host-skullstation="));
  EXPECT_THAT(cookie, HasSubstr("; Path=/; Secure; HttpOnly; SameSite=Strict"));
  Request request = small_.request("GET", "/api/v1/session");
  request.headers["cookie"] = cookie.substr(0, cookie.find(';'));
  EXPECT_EQ(answer_request(small_.console(), request).status, 200u);
  request.method = "DELETE";
  request.headers["x-csrf-token"] = json::parse(in.body)["csrf"];
  const Response out = answer_request(small_.console(), request);
  EXPECT_EQ(out.status, 204u);
  EXPECT_THAT(header(out, "Set-Cookie"), HasSubstr("Max-Age=0"));
  request.method = "GET";
  EXPECT_EQ(answer_request(small_.console(), request).status, 401u);
  EXPECT_THAT(small_.audit_log(), HasSubstr(R"("who":"operator","what":"console: sign in")"));
  EXPECT_THAT(small_.audit_log(), HasSubstr("console: sign out"));
}

TEST_F(ConsoleApi, AThousandGuessesOpenNothing) {
  int looked_at = 0;
  for (int i = 0; i < 1000; ++i) {
    const Response response = send(
        "POST", "/session", fmt::format(R"({{"name":"operator","password":"guess {}"}})", i), "");
    ASSERT_TRUE(response.status == 401 || response.status == 429) << response.status;
    if (response.status == 401) ++looked_at;
    if (response.status == 429) {
      EXPECT_NE(header(response, "Retry-After"), "");
    }
  }
  EXPECT_LE(looked_at, 8) << "five at once, and what the time that this took allows";
  EXPECT_EQ(
      send("POST", "/session", R"({"name":"operator","password":"correct horse battery"})", "")
          .status,
      429u)
      << "the right one is no exception";
  const std::string log = small_.audit_log();
  EXPECT_THAT(log, HasSubstr("\"status\":401"));
  EXPECT_LE(std::count(log.begin(), log.end(), '\n'), 10);
  EXPECT_THAT(log, Not(HasSubstr("guess")));
}

TEST_F(ConsoleApi, ChangesAPassword) {
  EXPECT_EQ(send("PUT", "/session/password", R"({"old":"wrong wrong","new":"another password"})",
                 "viewer")
                .status,
            403u);
  EXPECT_EQ(
      send("PUT", "/session/password", R"({"old":"correct horse battery","new":"short"})", "viewer")
          .status,
      422u);
  const Response changed =
      send("PUT", "/session/password",
           R"({"old":"correct horse battery","new":"another password"})", "viewer");
  EXPECT_EQ(changed.status, 200u) << changed.body;
  EXPECT_NE(header(changed, "Set-Cookie"), "");
  EXPECT_EQ(small_.ask("GET", "/api/v1/session", "viewer").status, 401u) << "the old sign-in";
}

TEST_F(ConsoleApi, TellsOfTheStation) {
  const json station = get("/station", "viewer");
  EXPECT_EQ(station["state"], "starting");
  EXPECT_EQ(station["version"], "1.2.3");
  EXPECT_EQ(station["simulated"], false);
  EXPECT_EQ(station["cameras"].size(), 2u);
  EXPECT_EQ(station["steps"][0]["name"], "reconstruct");
  const json check = get("/station/check", "auditor");
  EXPECT_EQ(check["certificate_sha256"], "AB:CD");
  EXPECT_GT(check["free_bytes"].get<double>(), 0.0);
  EXPECT_GE(check["findings"].size(), 3u);
  EXPECT_EQ(small_.ask("GET", "/api/v1/station/scan", "viewer").status, 404u);
  EXPECT_EQ(small_.ask("GET", "/api/v1/station/preview?camera=none", "viewer").status, 404u);
  EXPECT_EQ(small_.ask("GET", "/api/v1/station/preview", "viewer").status, 503u);
}

TEST_F(ConsoleApi, RefusesWhatMeansNothingNow) {
  for (const char* what : {"confirm", "cancel", "reset"}) {
    const Response response = send("POST", fmt::format("/station/{}", what), "", "operator");
    EXPECT_EQ(response.status, 409u) << what;
    EXPECT_THAT(response.body, HasSubstr("the station is starting")) << what;
  }
  EXPECT_EQ(send("POST", "/station/start", "{}", "operator").status, 409u);
  EXPECT_EQ(send("POST", "/station/hand", R"({"hand":"press"})", "operator").status, 409u);
  EXPECT_EQ(send("POST", "/station/hand", R"({"hand":"wave"})", "operator").status, 422u);
  for (const char* number : {"\\n", "   ", "\\u0000", "a\\u007f"}) {
    const Response response = send("POST", "/station/start",
                                   fmt::format(R"({{"case_number":"{}"}})", number), "operator");
    EXPECT_EQ(response.status, 422u) << number;
  }
  EXPECT_EQ(send("POST", "/station/start",
                 fmt::format(R"({{"case_number":"{}"}})", std::string(65, 'x')), "operator")
                .status,
            422u);
}

TEST_F(ConsoleApi, ShowsCasesAndTheirFiles) {
  const Case scanned = finished_case("2026-0042");
  finished_case("<script>alert(1)</script>");
  const json all = get("/cases");
  EXPECT_EQ(all["all"], 2);
  EXPECT_EQ(all["cases"][0]["number"], "<script>alert(1)</script>") << "text, as it was typed";
  EXPECT_EQ(get("/cases?search=0042")["cases"].size(), 1u);
  EXPECT_EQ(get("/cases?search=SCRIPT")["all"], 1);
  EXPECT_EQ(get("/cases?search=%25")["all"], 0) << "no pattern";
  EXPECT_EQ(get("/cases?most=1&skip=1")["cases"][0]["number"], "2026-0042");
  EXPECT_EQ(get("/cases?most=x")["cases"].size(), 2u);

  const json whole = get(fmt::format("/cases/{}", scanned.id));
  EXPECT_EQ(whole["state"], "done") << whole.dump(2);
  EXPECT_EQ(whole["jobs"].size(), 3u);
  EXPECT_THAT(whole["events"].dump(), HasSubstr("scan saved"));
  for (const char* nothing :
       {"/cases/99", "/cases/x", "/cases/-1", "/cases/99999999999999999999"}) {
    EXPECT_EQ(send("GET", nothing).status, 404u) << nothing;
  }

  const std::int64_t job = job_of(scanned.id, "approximate");
  const json files = get(fmt::format("/jobs/{}/files", job))["files"];
  EXPECT_EQ(files.size(), 4u);
  const Response report = send("GET", fmt::format("/jobs/{}/files/report.html", job));
  ASSERT_TRUE(report.file);
  EXPECT_THAT(header(report, "Content-Security-Policy"), HasSubstr("sandbox;"));
  EXPECT_EQ(header(report, "Content-Type"), "text/html; charset=utf-8");
  for (const char* nothing : {"report.htm", "no/report.html", "x/..%00"}) {
    if (!parse_target(fmt::format("/{}", nothing))) continue;
    EXPECT_EQ(send("GET", fmt::format("/jobs/{}/files/{}", job, nothing)).status, 404u) << nothing;
  }
  EXPECT_EQ(send("GET", "/jobs/999/files").status, 404u);
}

TEST_F(ConsoleApi, GivesPartsOfFiles) {
  const Case scanned = finished_case("1");
  Request request = small_.request(
      "GET", fmt::format("/api/v1/jobs/{}/files/head.ply", job_of(scanned.id, "approximate")),
      "viewer");
  const auto ask = [&] { return answer_request(small_.console(), request); };
  const Response whole = ask();
  ASSERT_TRUE(whole.file);
  request.headers["range"] = "bytes=2-3";
  const Response part = ask();
  EXPECT_EQ(part.status, 206u);
  EXPECT_EQ(part.file->begin, 2u);
  EXPECT_EQ(part.file->bytes, 2u);
  EXPECT_EQ(header(part, "Content-Range"), fmt::format("bytes 2-3/{}", whole.file->bytes));
  request.headers["if-range"] = "\"another\"";
  EXPECT_EQ(ask().status, 200u);
  request.headers.erase("if-range");
  request.headers["range"] = "bytes=999999-";
  EXPECT_EQ(ask().status, 416u);
  request.headers.erase("range");
  request.headers["if-none-match"] = header(whole, "ETag");
  EXPECT_EQ(ask().status, 304u);
}

TEST_F(ConsoleApi, LetsExaminersWork) {
  const Case scanned = finished_case("7");
  const std::string path = fmt::format("/cases/{}", scanned.id);
  EXPECT_EQ(send("PUT", path + "/hold", R"({"reason":"appeal"})").status, 200u);
  EXPECT_EQ(get(path)["hold"], "appeal");
  EXPECT_EQ(send("PUT", path + "/hold", R"({"reason":""})").status, 422u);
  EXPECT_EQ(send("PUT", path + "/hold", R"({"reason":null})").status, 200u);
  EXPECT_FALSE(get(path).contains("hold"));
  EXPECT_EQ(send("PUT", path + "/priority", R"({"priority":5})").status, 200u);
  EXPECT_EQ(send("PUT", path + "/priority", R"({"priority":500})").status, 422u);
  EXPECT_EQ(get(path)["priority"], 5);

  const std::int64_t result = job_of(scanned.id, "approximate");
  EXPECT_EQ(send("POST", path + "/approval",
                 fmt::format(R"({{"job":{}}})", job_of(scanned.id, "reconstruct")))
                .status,
            409u)
      << "not a result";
  const std::string approval = fmt::format(R"({{"job":{},"note":"seen"}})", result);
  EXPECT_EQ(send("POST", path + "/approval", approval).status, 200u);
  EXPECT_EQ(send("POST", path + "/approval", approval).status, 409u) << "once";
  const json sealing = get(path)["jobs"].back();
  EXPECT_EQ(sealing["step"], "seal");
  EXPECT_EQ(sealing["options"]["approved_by"], "examiner");
  EXPECT_EQ(sealing["inputs"]["approximate"], result);
  EXPECT_EQ(get(path)["jobs"][2]["approved"]["by"], "examiner");
  ASSERT_TRUE(comes_true([&] { return get(path)["state"] == "done"; }));
  EXPECT_EQ(send("POST", path + "/rerun", R"({"step":"seal","options":{}})").status, 409u);

  EXPECT_EQ(send("POST", path + "/rerun", R"({"step":"none","options":{}})").status, 409u);
  EXPECT_EQ(send("POST", path + "/rerun", R"({"step":"approximate","options":[]})").status, 422u);
  const Response anew =
      send("POST", path + "/rerun", R"({"step":"approximate","options":{"do":"fail"}})");
  ASSERT_EQ(anew.status, 201u) << anew.body;
  const std::int64_t second = json::parse(anew.body)["job"];
  EXPECT_EQ(send("POST", path + "/approval", fmt::format(R"({{"job":{}}})", result)).status, 409u)
      << "it is being made anew";
  ASSERT_TRUE(comes_true([&] { return get(path)["state"] != "building"; }));
  EXPECT_EQ(send("POST", fmt::format("/jobs/{}/cancel", second)).status, 409u);
  EXPECT_EQ(send("POST", "/jobs/999/retry").status, 404u);

  const std::string log = small_.audit_log();
  for (const char* what : {"hold case", "prioritise case", "approve case", "rerun step"}) {
    EXPECT_THAT(
        log, HasSubstr(fmt::format(R"("who":"examiner","what":"console: {}","case":"7")", what)));
  }
}

TEST_F(ConsoleApi, WhatWasApprovedBeforeACrashIsSealedAtTheNextStart) {
  const auto scanned = finished_case("7");
  const std::int64_t result = job_of(scanned.id, "approximate");
  Approvals& approvals = small_.console().approvals;
  ASSERT_TRUE(approvals.approve(result, "anna", ""));
  ASSERT_TRUE(approvals.approve(4711, "anna", "of a job that is no more"));
  EXPECT_EQ(job_of(scanned.id, "seal"), 0);
  ASSERT_TRUE(seal_approved(approvals, small_.service()));
  const std::int64_t sealing = job_of(scanned.id, "seal");
  EXPECT_NE(sealing, 0);
  ASSERT_TRUE(seal_approved(approvals, small_.service()));
  EXPECT_EQ(job_of(scanned.id, "seal"), sealing) << "once";
}

TEST_F(ConsoleApi, ShowsDeliveriesAndLetsThemBeRetriedAndHeld) {
  const auto scanned = finished_case("7");
  const std::string path = fmt::format("/cases/{}", scanned.id);
  EXPECT_TRUE(get(path)["deliveries"].empty());
  EXPECT_EQ(get(path)["targets"], json::array({"records"}));
  const std::int64_t result = job_of(scanned.id, "approximate");
  ASSERT_TRUE(small_.service().seal(result, "anna"));
  SealedPackage package;
  Job sealing;
  sealing.id = job_of(scanned.id, "seal");
  sealing.case_id = scanned.id;
  package.folder = package_folder(small_.service().store(), sealing);
  package.case_number = "7";
  package.sha256 = std::string(64, 'a');
  Outbox& outbox = small_.service().outbox();
  const auto row = outbox.add(package, "records");
  ASSERT_TRUE(row);
  json shown = get(path)["deliveries"];
  ASSERT_EQ(shown.size(), 1u);
  EXPECT_EQ(shown[0]["target"], "records");
  EXPECT_EQ(shown[0]["state"], "queued");
  EXPECT_TRUE(shown[0]["last_error"].is_null());

  const std::string of = fmt::format("/deliveries/{}", row->id);
  EXPECT_EQ(send("POST", of + "/retry", "", "operator").status, 409u) << "it goes anyway";
  EXPECT_EQ(send("POST", of + "/hold").status, 200u);
  EXPECT_EQ(get(path)["deliveries"][0]["state"], "held");
  EXPECT_EQ(send("POST", of + "/retry", "", "operator").status, 200u);
  EXPECT_EQ(get(path)["deliveries"][0]["state"], "queued");
  EXPECT_EQ(send("POST", "/deliveries/77/retry").status, 404u);
  EXPECT_THAT(small_.audit_log(),
              HasSubstr(R"("who":"examiner","what":"console: hold delivery","case":"7")"));
}

TEST_F(ConsoleApi, KeepsAccounts) {
  const auto post = [&](const std::string& body) {
    return send("POST", "/accounts", body, "administrator").status;
  };
  EXPECT_EQ(post(R"({"name":"anna","role":"examiner","password":"correct horse"})"), 201u);
  EXPECT_EQ(post(R"({"name":"anna","role":"examiner","password":"correct horse"})"), 409u);
  EXPECT_EQ(post(R"({"name":"berta","role":"king","password":"correct horse"})"), 422u);
  EXPECT_EQ(post(R"({"name":"berta","role":"viewer","password":"short"})"), 422u);
  EXPECT_EQ(get("/accounts", "auditor")["accounts"].size(), 6u);
  const auto patch = [&](const std::string& name, const std::string& body) {
    return send("PATCH", "/accounts/" + name, body, "administrator").status;
  };
  EXPECT_EQ(patch("anna", R"({"role":"viewer"})"), 200u);
  EXPECT_EQ(patch("anna", R"({"disabled":true})"), 200u);
  EXPECT_EQ(patch("anna", R"({"password":"another password"})"), 200u);
  EXPECT_EQ(patch("anna", R"({"role":"viewer","disabled":true})"), 422u);
  EXPECT_EQ(patch("nobody", R"({"disabled":true})"), 404u);
  EXPECT_EQ(patch("administrator", R"({"disabled":true})"), 409u) << "the last one";
  EXPECT_THAT(small_.audit_log(), Not(HasSubstr("another password")));
}

TEST_F(ConsoleApi, ShowsTheAuditLog) {
  EXPECT_EQ(send("GET", "/audit/check", "", "auditor").status, 422u) << "nothing was written yet";
  EXPECT_EQ(get("/audit", "auditor")["entries"].size(), 0u);
  send("POST", "/station/start", R"({"case_number":"2026-0042"})", "operator");
  const json log = get("/audit", "auditor");
  ASSERT_EQ(log["entries"].size(), 2u);
  EXPECT_EQ(log["entries"][0]["who"], "operator");
  EXPECT_EQ(log["entries"][0]["details"]["status"], 409);
  EXPECT_EQ(get("/audit?case=2026-0042", "auditor")["entries"].size(), 1u);
  EXPECT_EQ(get("/audit/check", "administrator")["intact"], true);
}

TEST_F(ConsoleApi, TellsWhatHappens) {
  const Response response = send("GET", "/events", "", "viewer");
  ASSERT_TRUE(response.events);
  const std::string first = response.events->take();
  EXPECT_THAT(first, HasSubstr("event: station\ndata: {\"state\":\"starting\""));
  response.events->push("x");
  EXPECT_EQ(response.events->take(), "x");
  EXPECT_FALSE(response.events->push(std::string(EventQueue::most_bytes + 1, 'x')));
}

TEST_F(ConsoleApi, ServesItsPages) {
  Request request = small_.request("GET", "/");
  const Response plain = answer_request(small_.console(), request);
  EXPECT_EQ(plain.status, 200u);
  EXPECT_THAT(plain.body, HasSubstr("<!doctype html>"));
  EXPECT_THAT(header(plain, "Content-Security-Policy"), HasSubstr("script-src 'self'"));
  EXPECT_THAT(header(plain, "Content-Security-Policy"), Not(HasSubstr("unsafe")));
  request.headers["accept-encoding"] = "gzip, br";
  const Response small = answer_request(small_.console(), request);
  EXPECT_EQ(header(small, "Content-Encoding"), "gzip");
  EXPECT_EQ(small.body.substr(0, 2), "\x1f\x8b");
  request.headers["if-none-match"] = header(small, "ETag");
  EXPECT_EQ(answer_request(small_.console(), request).status, 304u);
}

}  // namespace
}  // namespace skullstation
