// `skullstationd` killed, or its disk full, at random moments while somebody works at the console:
// scans are started, turned over and resumed, steps made, made anew, held, approved. What a program
// was told over HTTPS is there afterwards and intact; what was not finished goes on.
// SKULLSTATION_LONG=1: 200 kills and 40 full disks instead of 10 and 4.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>

#include "core/file.h"
#include "core/random.h"
#include "core/session/session.h"
#include "daemon/database/database.h"
#include "daemon/evidence/audit_check.h"
#include "daemon/http/approvals.h"
#include "tests/e2e/console_examiner.h"
#include "tests/e2e/small_station.h"
#include "tests/support/console_user.h"
#include "tests/support/process.h"
#include "tests/support/small_disk.h"
#include "tests/support/station_client.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using skullstation::testing::Acknowledged;
using skullstation::testing::comes_true;
using skullstation::testing::Examiner;
using skullstation::testing::HttpsAnswer;
using skullstation::testing::Medium;
using skullstation::testing::Process;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr auto password = "correct horse battery";
constexpr std::size_t views_of_a_scan = 8;

bool long_form() {
  const char* wish = std::getenv("SKULLSTATION_LONG");
  return wish != nullptr && std::string(wish) == "1";
}

/// The daemon, its folders, and what must be true of them.
class StationAtWork {
 public:
  explicit StationAtWork(fs::path folder) : folder_(std::move(folder)) {
    config_ = skullstation::testing::write_quick_station(folder_, "", "", "[http]\nport = 0\n");
    const json steps = {{"sleep_ms", 40}, {"claim", (folder_ / "claim").string()}};
    fs::create_directories(storage());
    EXPECT_TRUE(write_file_durably(storage() / "step-options", steps.dump()));
  }

  fs::path storage() const { return folder_ / "store"; }
  Process& daemon() { return *daemon_; }
  void start() {
    daemon_ = std::make_unique<Process>(skullstation::testing::daemon_command(config_, storage()));
  }
  /// The address, once it is told; nothing if the daemon ends before.
  std::optional<std::uint16_t> port() const {
    const std::string after = told_after("console: https://localhost:");
    if (after.empty()) return std::nullopt;
    return static_cast<std::uint16_t>(std::stoi(after));
  }
  /// Its first start: an examiner's account, signed in.
  void set_up(Examiner& examiner) {
    start();
    ASSERT_TRUE(comes_true([&] { return !told_after("station TEST: ").empty(); }))
        << daemon_->err_so_far();
    ASSERT_TRUE(examiner.connect(*port()));
    ASSERT_TRUE(examiner.sign_in("/setup", {{"code", told_after("set-up code: ").substr(0, 14)},
                                            {"name", "anna"},
                                            {"password", password}}));
    const json account = {{"name", "eve"}, {"role", "examiner"}, {"password", password}};
    ASSERT_EQ(examiner.ask("POST", "/accounts", account).status, 201);
    ASSERT_TRUE(examiner.sign_in("/session", {{"name", "eve"}, {"password", password}}));
  }

  /// Of a station that is not running. Each line of a long audit log has a signature to be checked:
  /// `whole_log` false leaves that out.
  void expect_intact(const Acknowledged& told, bool whole_log = true) {
    const SystemClock clock;
    const auto store = CaseStore::open(storage(), clock, "test");
    ASSERT_TRUE(store) << store.error().message();
    EXPECT_THAT((*store)->damage(true), IsEmpty());
    for (const auto& [id, number] : told.saved) {
      const auto kept = (*store)->case_of(id);
      ASSERT_TRUE(kept) << "case " << id << " was saved and is lost";
      EXPECT_EQ(kept->number, number);
      expect_scan(**store, id, views_of_a_scan);
      if (told.holds.contains(id)) {
        EXPECT_EQ(kept->hold, told.holds.at(id)) << number;
      }
    }
    for (const auto& [id, views] : told.views) expect_scan(**store, id, views);
    for (const auto& [job, files] : told.artifacts) {
      const auto kept = (*store)->files(job);
      ASSERT_TRUE(kept);
      ASSERT_EQ(kept->size(), files.size()) << "job " << job;
      for (std::size_t i = 0; i < files.size(); ++i) {
        EXPECT_EQ((*kept)[i].path, files[i]["path"]);
        EXPECT_EQ((*kept)[i].sha256, files[i]["sha256"]);
      }
    }
    for (const auto& [job, id] : told.reruns) {
      const auto kept = (*store)->job(job);
      ASSERT_TRUE(kept) << "job " << job << " was appointed and is lost";
      EXPECT_EQ(kept->case_id, id);
    }
    auto console = Database::open(storage() / "console.db");
    ASSERT_TRUE(console);
    EXPECT_EQ(console->damage(), "");
    const auto approvals = Approvals::open(storage() / "console.db", clock);
    for (const std::int64_t job : told.approved) {
      EXPECT_TRUE(*(*approvals)->of(job)) << "the approval of job " << job << " is lost";
    }
    if (whole_log) expect_signed_log();
    expect_audit(told);
    EXPECT_FALSE(fs::exists(folder_ / "claim.twice")) << "a step ran twice at once";
  }

  /// How many times a step was interrupted so far.
  int interruptions() const {
    const SystemClock clock;
    const auto store = CaseStore::open(storage(), clock, "test");
    auto database = Database::open(storage() / "station.db");
    Statement query = database->statement("SELECT SUM(interruptions) FROM jobs");
    return query.next() ? static_cast<int>(query.integer()) : 0;
  }
  bool is_scanning() const {
    const SystemClock clock;
    const auto store = CaseStore::open(storage(), clock, "test");
    return (*store)->unfinished_scan()->has_value();
  }

 private:
  std::string told_after(const std::string& words) const {
    const std::string all = daemon_->err_so_far();
    const auto at = all.find(words);
    if (at == std::string::npos || all.find('\n', at) == std::string::npos) return {};
    return all.substr(at + words.size());
  }

  /// The session of a case, wherever it is now, has so many pictures or more, and they are intact.
  static void expect_scan(CaseStore& store, std::int64_t id, std::size_t views) {
    if (views == 0) return;  // a scan without any is given up at the next start
    const auto jobs = *store.jobs(id);
    ASSERT_FALSE(jobs.empty()) << "case " << id;
    if (jobs[0].state != JobState::done) {
      const fs::path folder = store.scan_folder(id);
      const auto session = read_session(folder);
      ASSERT_TRUE(session) << session.error().message();
      EXPECT_GE(session->views.size(), views) << "case " << id;
      const auto sound = verify_images(*session, folder);
      EXPECT_TRUE(sound) << sound.error().message();
      return;
    }
    const auto files = *store.files(jobs[0].id);
    std::size_t images = 0;
    for (const ArtifactFile& file : files) images += file.path.starts_with("images/") ? 1 : 0;
    EXPECT_EQ(images, views_of_a_scan) << "case " << id;
  }

  /// It is whole and names all that was done.
  void expect_signed_log() const {
    const auto check = check_audit_file(storage() / "audit.log", std::nullopt, {});
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_TRUE(check->findings.empty())
        << check->findings.front().line << ": " << check->findings.front().what;
  }

  void expect_audit(const Acknowledged& told) const {
    const std::string log = read_file(storage() / "audit.log").value_or("");
    for (const auto& [what, times] : told.audit) {
      const std::string words = "\"console: " + what + "\"";
      std::size_t found = 0;
      for (auto at = log.find(words); at != std::string::npos; at = log.find(words, at + 1)) {
        ++found;
      }
      EXPECT_GE(found, times) << what;
    }
  }

  const fs::path folder_;
  fs::path config_;
  std::unique_ptr<Process> daemon_;
};

/// Something more, at a station that must be there: on a busy machine an answer may come too late.
void keep_acting(StationAtWork& station, Examiner& examiner) {
  if (examiner.act()) return;
  EXPECT_TRUE(examiner.connect(*station.port())) << station.daemon().err_so_far();
}

/// Until every case has come to its end.
void finish(StationAtWork& station, Examiner& examiner) {
  const bool ended = comes_true(
      [&] {
        keep_acting(station, examiner);
        return ::testing::Test::HasFailure() || examiner.all_ended();
      },
      300s);
  EXPECT_TRUE(ended) << examiner.ask("GET", "/cases").body;
}

void end(StationAtWork& station) {
  station.daemon().send(SIGTERM);
  const auto result = station.daemon().wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST(ConsoleCrash, WhatWasAcknowledgedSurvivesKillsAtRandomMoments) {
  const int kills = long_form() ? 200 : 10;
  const TemporaryFolder folder(Medium::memory);
  StationAtWork station(folder.path());
  Examiner examiner(static_cast<std::size_t>(kills) / 2);
  station.set_up(examiner);
  if (::testing::Test::HasFatalFailure()) return;
  end(station);
  Random random(20260131);
  int while_starting = 0;
  int during_scans = 0;
  int during_steps = 0;
  int during_answers = 0;
  std::uint64_t longest_ms = 1000;
  for (int kill = 0; kill < kills; ++kill) {
    const std::size_t saved_before = examiner.told().saved.size();
    const int interrupted_before = station.interruptions();
    station.start();
    std::atomic<bool> killed = false;
    // Most kills come while the console answers, some before.
    std::jthread killer([&, early = random.below(5) == 0, moment = random.below(longest_ms)] {
      if (!early) comes_true([&] { return station.port().has_value(); });
      std::this_thread::sleep_for(std::chrono::milliseconds(moment));
      killed = true;
      station.daemon().send(SIGKILL);
    });
    while (!killed && !station.port()) std::this_thread::sleep_for(1ms);
    if (!station.port() || !examiner.connect(*station.port())) {
      ++while_starting;
    } else {
      bool answered = true;
      while (answered && !killed) answered = examiner.act();
      during_answers += answered ? 0 : 1;
    }
    killer.join();
    const auto result = station.daemon().wait();
    ASSERT_EQ(result.exit_code, 128 + SIGKILL) << "kill " << kill << ": " << result.err;
    const bool whole_log = kill % 10 == 9;
    ASSERT_NO_FATAL_FAILURE(station.expect_intact(examiner.told(), whole_log)) << "kill " << kill;
    if (::testing::Test::HasFailure()) FAIL() << "kill " << kill << ": " << result.err;
    during_steps += station.interruptions() > interrupted_before ? 1 : 0;
    during_scans += station.is_scanning() ? 1 : 0;
    // On a slow machine it takes longer until there is something to lose.
    const bool in_vain = examiner.wants_more() && examiner.told().saved.size() == saved_before;
    longest_ms = in_vain ? std::min<std::uint64_t>(2 * longest_ms, 20'000)
                         : std::max<std::uint64_t>(longest_ms / 2, 1000);
  }
  station.start();
  ASSERT_TRUE(comes_true([&] { return station.port().has_value(); }));
  ASSERT_TRUE(examiner.connect(*station.port()));
  finish(station, examiner);
  end(station);
  station.expect_intact(examiner.told());
  const Acknowledged& told = examiner.told();
  EXPECT_GT(told.saved.size(), 0U);
  EXPECT_GT(told.artifacts.size(), told.saved.size());
  EXPECT_GT(during_scans + during_steps, 0);
  fmt::print(
      "{} kills: {} while starting, {} during scans, {} during steps, {} before an answer; {} "
      "cases, {} artifacts, {} made anew, {} holds, {} approvals\n",
      kills, while_starting, during_scans, during_steps, during_answers, told.saved.size(),
      told.artifacts.size(), told.reruns.size(), told.holds.size(), told.approved.size());
}

constexpr std::uint64_t much_space = std::uint64_t{64} << 30;  // none of it is taken

TEST(ConsoleCrash, ADiskThatFillsUpAtRandomMomentsLosesNothing) {
  const TemporaryFolder folder;
  const bool allowed = testing::on_small_disk(folder.path(), much_space, [&] {
    const int times = long_form() ? 40 : 4;
    StationAtWork station(folder.path());
    Examiner examiner(static_cast<std::size_t>(times) + 1);
    station.set_up(examiner);
    Random random(20260131);
    for (int time = 0; time < times && !::testing::Test::HasFailure(); ++time) {
      const auto act_for = [&](std::uint64_t ms) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(ms);
        while (std::chrono::steady_clock::now() < end) {
          keep_acting(station, examiner);
        }
      };
      act_for(random.below(800));
      testing::leave_no_space(folder.path());
      act_for(200 + random.below(400));
      testing::resize_disk(folder.path(), much_space);
    }
    finish(station, examiner);
    end(station);
    station.expect_intact(examiner.told());
    EXPECT_GT(examiner.told().saved.size(), 0U);
  });
  if (!allowed) GTEST_SKIP() << "a file system can't be mounted here (neither root nor namespaces)";
}

TEST(ConsoleCrash, AScanThatHasBegunHasItsSpaceAndOnAFullDiskTheNextIsRefused) {
  const TemporaryFolder folder;
  const bool allowed = testing::on_small_disk(folder.path(), much_space, [&] {
    StationAtWork station(folder.path());
    Examiner examiner(0);
    station.set_up(examiner);
    const auto now = [&] { return examiner.ask("GET", "/station").body; };
    const auto becomes = [&](const std::string& wanted) {
      return comes_true(
          [&] { return now().find("\"state\":\"" + wanted + "\"") != std::string::npos; });
    };
    const auto press = [&](const char* path, const json& body = nullptr) {
      const HttpsAnswer answer = examiner.ask("POST", path, body);
      // The audit log may have no space left either: then the answer says so.
      if (answer.status != 202) {
        EXPECT_THAT(answer.body, HasSubstr("the audit log can't be written"));
      }
    };
    ASSERT_TRUE(becomes("ready"));
    press("/station/start", json::object());
    ASSERT_TRUE(becomes("turn-over"));
    testing::leave_no_space(folder.path());
    press("/station/confirm");
    ASSERT_TRUE(becomes("building")) << now() << station.daemon().err_so_far();
    EXPECT_TRUE(comes_true([&] {
      return now().find("reconstruct of case 1 waits") != std::string::npos;
    })) << now();
    EXPECT_THAT(now(), HasSubstr("free some space on this volume"));
    press("/station/start", json::object());
    EXPECT_TRUE(comes_true([&] {
      return now().find("a scan and its models may need") != std::string::npos;
    })) << now();
    testing::resize_disk(folder.path(), much_space);
    ASSERT_TRUE(becomes("result")) << now();
    ASSERT_TRUE(examiner.act());
    end(station);
    station.expect_intact(examiner.told());
    EXPECT_EQ(examiner.told().saved.size(), 1U);
  });
  if (!allowed) GTEST_SKIP() << "a file system can't be mounted here (neither root nor namespaces)";
}

}  // namespace
}  // namespace skullstation
