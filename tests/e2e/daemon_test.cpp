// `skullstationd` on a small simulated station, with steps that are quick: from the button to the
// result, the next specimen meanwhile, what a person at the station can do wrong and what a step
// can. That it is killed, or its disk full, is in console_crash_test.cpp.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/file.h"
#include "tests/e2e/small_station.h"
#include "tests/support/console_user.h"
#include "tests/support/process.h"
#include "tests/support/station_client.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using skullstation::testing::Medium;
using skullstation::testing::Process;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

class Daemon : public ::testing::Test {
 protected:
  void TearDown() override {
    if (HasFailure() && daemon_) {
      daemon_->send(SIGKILL);
      std::cerr << daemon_->wait().err;
    }
  }

  /// Writes the configuration: a turntable that is quick in real time.
  void configure(const std::string& camera = "", const std::string& station = "",
                 const std::string& extra = "[http]\nenabled = false\n") {
    config_ = skullstation::testing::write_quick_station(folder_.path(), camera, station, extra);
  }

  std::vector<std::string> command() const {
    return skullstation::testing::daemon_command(config_, storage());
  }
  fs::path storage() const { return folder_ / "store"; }
  void start() { daemon_ = std::make_unique<Process>(command()); }

  json ask(const std::string& line) const {
    return skullstation::testing::ask_station(storage() / "control", line);
  }
  std::string state() const {
    const json status = ask("status");
    return status.is_object() ? status.value("state", "") : "";
  }
  std::string message() const { return ask("status").value("message", ""); }
  std::string signal() const { return ask("status").value("signal", ""); }
  bool becomes(const std::string& wanted) const {
    const bool became = skullstation::testing::comes_true([&] { return state() == wanted; }, 300s);
    if (!became) ADD_FAILURE() << "still " << ask("status").dump() << ", not " << wanted;
    return became;
  }
  /// None as long as a daemon that was just started doesn't answer.
  json cases() const {
    const json answer = ask("cases");
    return answer.is_object() ? answer["cases"] : json::array();
  }
  json job(int case_id, const std::string& step) const {
    const json answer = ask(fmt::format("jobs {}", case_id));
    for (const json& row : answer["jobs"]) {
      if (row["step"] == step) return row;
    }
    return {};
  }
  /// As the store has it: the views of the case's session, after a look at every image.
  std::size_t views_of(int case_id) const {
    const int scan = job(case_id, "scan")["id"];
    std::size_t images = 0;
    std::size_t views = 0;
    const json answer = ask(fmt::format("files {}", scan));
    for (const json& file : answer["files"]) {
      const auto bytes = read_file(file["blob"].get<std::string>());
      EXPECT_TRUE(bytes);
      EXPECT_EQ(sha256_hex(*bytes), file["sha256"]);
      if (file["path"].get<std::string>().starts_with("images/")) ++images;
      if (file["path"] == "session.json") {
        const json session = json::parse(*bytes);
        EXPECT_TRUE(session["complete"]);
        views = session["views"].size();
      }
    }
    EXPECT_EQ(images, views);
    return views;
  }
  /// From the lamp to the result: two presses.
  void scan_one() {
    ASSERT_TRUE(becomes("ready"));
    ask("press");
    ASSERT_TRUE(becomes("turn-over"));
    ask("press");
    ASSERT_TRUE(becomes("result"));
  }
  /// A folder as a receiver, and a configuration that names it.
  std::string records_target() const {
    fs::create_directories(folder_ / "records");
    return fmt::format(
        "[[delivery.targets]]\nname = \"records\"\nprotocol = \"folder\"\naddress = \"{}\"\n",
        (folder_ / "records").string());
  }
  /// The one package that has arrived is as it was sealed, by this station; who sealed it.
  std::string sealed_by() const {
    std::vector<fs::path> arrived;
    for (const auto& entry : fs::directory_iterator(folder_ / "records")) {
      arrived.push_back(entry.path());
    }
    EXPECT_EQ(arrived.size(), 1U);
    if (arrived.size() != 1) return {};
    const auto check =
        skullstation::testing::skullstation_cli({"verify", "--json", arrived[0].string(), "--trust",
                                                 (storage() / "keys/ed25519.pub.pem").string()});
    EXPECT_EQ(check.exit_code, 0) << check.out;
    const json shown = json::parse(check.out);
    EXPECT_EQ(shown["trusted"], true);
    EXPECT_TRUE(fs::exists(arrived[0] / "data/session/session.json"));
    return shown["audit_entry"]["who"];
  }
  /// What the next steps do, as options of fake_step.
  void let_steps(const json& options) const {
    ASSERT_TRUE(write_file_durably(storage() / "step-options", options.dump()));
  }
  /// Steps wait as long as this file is there.
  void hold_steps() { std::ofstream(folder_ / "store" / "hold-steps") << "x"; }
  void release_steps() { fs::remove(folder_ / "store" / "hold-steps"); }
  void end() {
    daemon_->send(SIGTERM);
    const auto result = daemon_->wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    daemon_.reset();
  }

  TemporaryFolder folder_{Medium::memory};
  fs::path config_;
  std::unique_ptr<Process> daemon_;
};

TEST_F(Daemon, FromButtonToResultAndTheNextSpecimenMeanwhile) {
  configure();
  start();
  ASSERT_TRUE(becomes("ready"));
  hold_steps();
  ask("number 2026-0042");
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  EXPECT_EQ(signal(), "attention");
  EXPECT_THAT(message(), HasSubstr("Lay the specimen upside down on the board"));
  ask("press");
  ASSERT_TRUE(becomes("building"));
  EXPECT_EQ(signal(), "building");
  EXPECT_THAT(message(), HasSubstr("Case 2026-0042 is saved"));
  EXPECT_EQ(views_of(1), 8U);

  ask("press");  // the next specimen, while the first case waits for its step
  ASSERT_TRUE(becomes("turn-over"));
  EXPECT_EQ(ask("status")["job"]["case"], 1) << "the step goes on meanwhile";
  ask("press");
  ASSERT_TRUE(becomes("building"));
  EXPECT_EQ(cases()[0]["state"], "building");
  EXPECT_EQ(cases()[1]["state"], "building");

  release_steps();
  ASSERT_TRUE(becomes("result"));
  EXPECT_EQ(signal(), "done");
  ASSERT_TRUE(skullstation::testing::comes_true([&] { return cases()[1]["state"] == "done"; }));
  EXPECT_EQ(cases()[0]["number"], "2026-0042");
  EXPECT_EQ(cases()[0]["state"], "done");
  EXPECT_EQ(job(1, "approximate")["state"], "done");
  EXPECT_EQ(views_of(2), 8U);
  ask("hold");  // seen
  ASSERT_TRUE(becomes("ready"));
  end();
}

TEST_F(Daemon, WithoutAnExaminerTheButtonAloneSealsAndDelivers) {
  configure(
      "", "",
      "[http]\nenabled = false\n[evidence]\nseal = \"built\"\n[delivery]\n" + records_target());
  start();
  scan_one();
  ASSERT_TRUE(skullstation::testing::comes_true([&] { return cases()[0].contains("verified"); }));
  EXPECT_EQ(sealed_by(), "skullstationd");
  end();
}

TEST_F(Daemon, WhatAnExaminerApprovesIsSealedAndDeliveredThroughKills) {
  configure("", "", "[http]\nport = 0\n[delivery]\n" + records_target());
  start();
  scan_one();
  const auto told = [&](const std::string& before, const char* end) {
    const std::string text = daemon_->err_so_far();
    const std::size_t at = text.find(before) + before.size();
    return text.substr(at, text.find(end, at) - at);
  };
  const std::string port = told("https://localhost:", "/");
  testing::ConsoleUser user;
  ASSERT_TRUE(user.connect(static_cast<std::uint16_t>(std::stoi(port))));
  ASSERT_TRUE(user.sign_in(
      "/setup",
      {{"code", told("set-up code: ", " ")}, {"name", "root"}, {"password", "correct horse"}}));
  const json account = {{"name", "dr.bone"}, {"role", "examiner"}, {"password", "long enough"}};
  ASSERT_EQ(user.ask("POST", "/accounts", account).status, 201);
  ASSERT_TRUE(user.sign_in("/session", {{"name", "dr.bone"}, {"password", "long enough"}}));
  std::this_thread::sleep_for(1200ms);
  EXPECT_TRUE(fs::is_empty(folder_ / "records")) << "nobody has approved it";
  hold_steps();
  const auto approved =
      user.ask("POST", "/cases/1/approval", {{"job", job(1, "approximate")["id"]}});
  ASSERT_EQ(approved.status, 200) << approved.body;
  ASSERT_TRUE(
      skullstation::testing::comes_true([&] { return job(1, "seal")["state"] == "running"; }));
  for (const int ms : {0, 300}) {  // a job that three kills interrupt has failed
    daemon_->send(SIGKILL);
    daemon_->wait();
    release_steps();
    start();
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
  }
  ASSERT_TRUE(skullstation::testing::comes_true([&] {
    const json all = cases();
    return !all.empty() && all[0].contains("verified");
  }));
  EXPECT_EQ(sealed_by(), "dr.bone");
  end();
}

TEST_F(Daemon, AHeldPressGivesTheScanUp) {
  configure();
  start();
  ASSERT_TRUE(becomes("ready"));
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  ask("hold");
  ASSERT_TRUE(becomes("ready"));
  EXPECT_EQ(cases()[0]["state"], "cancelled");
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  end();
  start();  // what was being scanned when the station went down waits for a person
  ASSERT_TRUE(becomes("turn-over"));
  ask("press");
  ASSERT_TRUE(becomes("result"));
  EXPECT_EQ(views_of(2), 8U);
  end();
}

TEST_F(Daemon, AnEmergencyStopIsLatchedAndTheScanGoesOnAfterwards) {
  configure();
  start();
  ASSERT_TRUE(becomes("ready"));
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  ask("press-stop");
  ASSERT_TRUE(becomes("fault"));
  EXPECT_EQ(signal(), "fault");
  ask("press");
  EXPECT_TRUE(skullstation::testing::comes_true([&] {
    return message().find("can't be reset: emergency stop pressed") != std::string::npos;
  }));
  ASSERT_TRUE(becomes("fault"));
  ask("release-stop");
  EXPECT_EQ(state(), "fault") << "latched";
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  ask("press");
  ASSERT_TRUE(becomes("result"));
  EXPECT_EQ(views_of(1), 8U);
  EXPECT_EQ(cases().size(), 1U);
  end();
}

TEST_F(Daemon, ACaseThatFailsLeavesTheStationReady) {
  configure();
  start();
  ASSERT_TRUE(becomes("ready"));
  let_steps({{"do", "fail"}});
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  ask("press");
  ASSERT_TRUE(becomes("result"));
  EXPECT_EQ(signal(), "attention");
  EXPECT_EQ(cases()[0]["state"], "failed");
  const json failed = job(1, "reconstruct");
  EXPECT_THAT(failed["error"].get<std::string>(), HasSubstr("made of cheese"));
  let_steps(json::object());
  EXPECT_EQ(ask(fmt::format("retry {}", failed["id"].get<int>()))["ok"], true);
  EXPECT_TRUE(skullstation::testing::comes_true([&] { return cases()[0]["state"] == "done"; }));
  end();
}

TEST_F(Daemon, AnUnpluggedCameraIsToldOfBeforeTheNextScan) {
  configure("unplugged_after_frames = 1\n", "camera_check_s = 1\n");
  start();
  ASSERT_TRUE(becomes("fault"));
  EXPECT_THAT(message(), HasSubstr("camera \"cam0\""));
  EXPECT_THAT(message(), HasSubstr("is unplugged"));
  end();
}

TEST_F(Daemon, ADamagedFileIsNamedWithItsCaseAfterTheNextStart) {
  configure();
  start();
  scan_one();
  const json files = ask(fmt::format("files {}", job(1, "scan")["id"].get<int>()))["files"];
  end();
  const fs::path blob = files[0]["blob"].get<std::string>();
  std::string bytes = *read_file(blob);
  bytes[bytes.size() / 2] ^= 1;
  fs::remove(blob);  // it is read-only
  std::ofstream(blob, std::ios::binary) << bytes;
  start();
  ASSERT_TRUE(becomes("ready"));
  ASSERT_TRUE(skullstation::testing::comes_true([&] { return cases()[0].contains("damage"); }));
  EXPECT_THAT(cases()[0]["damage"][0].get<std::string>(),
              HasSubstr("is damaged: " + files[0]["path"].get<std::string>()));
  end();
}

TEST_F(Daemon, AStepThatCrashesHangsOrEatsMemoryFailsItsCaseAlone) {
  configure();
  auto text = *read_file(config_) + "[jobs]\nmemory_mib = 256\n";
  ASSERT_TRUE(write_file_durably(config_, text));
  start();
  ASSERT_TRUE(becomes("ready"));
  let_steps({{"do", "segfault"}});
  ask("press");
  ASSERT_TRUE(becomes("turn-over"));
  ask("press");
  ASSERT_TRUE(becomes("result"));
  const int id = job(1, "reconstruct")["id"];
  const auto error = [&] { return job(1, "reconstruct")["error"].get<std::string>(); };
  EXPECT_THAT(error(), HasSubstr("Segmentation fault"));

  let_steps({{"do", "eat memory"}});
  ask(fmt::format("retry {}", id));
  ASSERT_TRUE(skullstation::testing::comes_true(
      [&] { return error().find("bad_alloc") != std::string::npos; }));
  EXPECT_EQ(cases()[0]["state"], "failed");

  let_steps({{"do", "hang"}});  // and won't listen
  ask(fmt::format("retry {}", id));
  ASSERT_TRUE(skullstation::testing::comes_true(
      [&] { return ask("status").value("job", json::object()).value("stage", "") == "half way"; }));
  let_steps(json::object());
  ask("press");  // the station is ready for the next specimen all the while
  ASSERT_TRUE(becomes("turn-over"));
  ask("press");
  ASSERT_TRUE(becomes("building"));
  ask(fmt::format("cancel-job {}", id));
  EXPECT_TRUE(skullstation::testing::comes_true([&] { return cases()[1]["state"] == "done"; }));
  EXPECT_EQ(cases()[0]["state"], "cancelled");
  EXPECT_EQ(ask(fmt::format("retry {}", id))["ok"], true);
  EXPECT_TRUE(skullstation::testing::comes_true([&] { return cases()[0]["state"] == "done"; }));
  end();
}

TEST_F(Daemon, TellsSystemdThatItIsReadyAndAlive) {
  configure();
  const fs::path notify = folder_ / "notify";
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, notify.c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  auto words = command();
  words.insert(words.begin(), {"/usr/bin/env", "NOTIFY_SOCKET=" + notify.string()});
  daemon_ = std::make_unique<Process>(words);
  std::string told;
  while (told.find("WATCHDOG=1") == std::string::npos) {
    char text[256] = {};
    ASSERT_GT(::recv(socket, text, sizeof text - 1, 0), 0);
    told += std::string(text) + "\n";
  }
  EXPECT_THAT(told, HasSubstr("READY=1"));
  ::close(socket);
  end();
}

TEST_F(Daemon, WhatIsWrongWithItsCallIsSaid) {
  const auto bin = skullstation::testing::skullstation_program().parent_path();
  const auto nothing = Process({(bin / "skullstationd").string()}).wait();
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("name one with --config, or try it with --simulate"));
  configure();
  start();
  ASSERT_TRUE(becomes("ready"));
  const auto second = Process(command()).wait();
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, HasSubstr("is used by another skullstationd"));
  EXPECT_THAT(ask("dance").value("error", ""), HasSubstr("unknown word \"dance\""));
  EXPECT_THAT(ask("retry 7").value("error", ""), HasSubstr("there is no such job"));
  end();
}

}  // namespace
}  // namespace skullstation
