// kill -9 of a station that saves scans and makes jobs, at random moments, and disks that are full
// at every possible write: what was acknowledged is there and intact, what was not finished goes
// on, no step runs twice at once. SKULLSTATION_LONG=1: 200 kills instead of 20.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "core/file.h"
#include "core/random.h"
#include "tests/support/process.h"
#include "tests/support/small_disk.h"
#include "tests/support/station_client.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using skullstation::testing::fake_chain;
using skullstation::testing::fake_engine_options;
using skullstation::testing::Medium;
using skullstation::testing::Process;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What the station has told so far.
struct Acknowledged {
  std::map<std::int64_t, std::string> saved;  // case to its number
  std::set<std::int64_t> done;
  std::map<std::int64_t, std::int64_t> rerun;  // case to job

  void read(const std::string& lines) {
    std::istringstream in(lines);
    for (std::string line; std::getline(in, line);) {
      std::istringstream words(line);
      std::string what;
      std::int64_t id = 0;
      words >> what >> id;
      ASSERT_NE(what, "error") << line;
      if (what == "saved") words >> saved[id];
      if (what == "rerun") words >> rerun[id];
      if (what == "done") done.insert(id);
    }
  }
};

std::string content(CaseStore& store, const Job& job, std::size_t file) {
  const auto files = store.files(job.id);
  if (!files || files->size() <= file) return "(no file)";
  return read_file(store.blob(files->at(file))).value_or("(unreadable)");
}

void expect_intact(CaseStore& store, const Acknowledged& told) {
  EXPECT_THAT(store.damage(true), IsEmpty());
  for (const auto& [id, number] : told.saved) {
    const auto kept = store.case_of(id);
    ASSERT_TRUE(kept) << "case " << id << " was saved and is lost";
    EXPECT_EQ(kept->number, number);
    const auto jobs = *store.jobs(id);
    ASSERT_FALSE(jobs.empty());
    EXPECT_EQ(jobs[0].state, JobState::done);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(content(store, jobs[0], i), fmt::format("<{}-{}>", number, i));
    }
    const std::string first = fmt::format("first(<{0}-0><{0}-1><{0}-2>)", number);
    for (const Job& job : jobs) {
      if (job.state != JobState::done) continue;
      if (job.step == "first") {
        EXPECT_EQ(content(store, job, 0), first);
      }
      if (job.step == "second") {
        EXPECT_EQ(content(store, job, 0),
                  "second(" + first + ")" + (job.options == R"({"mark": "?"})" ? "?" : "!"));
      }
    }
  }
  for (const auto& [id, job] : told.rerun) {
    const auto kept = store.job(job);
    ASSERT_TRUE(kept) << "job " << job << " was appointed and is lost";
    EXPECT_EQ(kept->case_id, id);
  }
}

TEST(JobsCrash, WhatWasAcknowledgedSurvivesKillsAtRandomMoments) {
  const char* wish = std::getenv("SKULLSTATION_LONG");
  const int kills = wish != nullptr && std::string(wish) == "1" ? 200 : 20;
  const TemporaryFolder folder(Medium::memory);
  const std::string program =
      (skullstation::testing::skullstation_program().parent_path() / "crashing_station").string();
  const auto command = [&](int run, int cases) {
    return std::vector<std::string>{program, folder.path().string(), std::to_string(run),
                                    std::to_string(cases)};
  };
  const SystemClock clock;
  Random random(20260131);
  Acknowledged told;
  std::size_t kills_with_something_to_lose = 0;
  std::uint64_t longest_ms = 250;
  for (int kill = 0; kill < kills; ++kill) {
    const std::size_t saved_before = told.saved.size();
    Process station(command(kill, 1000));
    const bool ended = station.wait_for(std::chrono::milliseconds(20 + random.below(longest_ms)));
    station.send(SIGKILL);
    const auto result = station.wait();
    ASSERT_FALSE(ended) << result.out << result.err;
    told.read(result.out);
    // On a slow machine it takes longer until there is something to lose.
    if (told.saved.size() == saved_before) longest_ms += longest_ms / 4;
    kills_with_something_to_lose += told.saved.empty() ? 0 : 1;
    const auto store = CaseStore::open(folder / "store", clock, "test");
    ASSERT_TRUE(store) << store.error().message();
    expect_intact(**store, told);
    if (::testing::Test::HasFatalFailure()) return;
    ASSERT_FALSE(fs::exists(folder / "claim.twice")) << "a step ran twice at once, kill " << kill;
  }
  EXPECT_GT(kills_with_something_to_lose, static_cast<std::size_t>(kills) / 2);
  EXPECT_GT(told.done.size(), 0U);
  // Jobs that three kills in a row hit wait for a person; all others are made.
  {
    const auto store = CaseStore::open(folder / "store", clock, "test");
    ASSERT_TRUE(store);
    const auto cases = *(*store)->cases();
    for (const Case& row : cases) {
      const auto jobs = *(*store)->jobs(row.id);
      for (const Job& job : jobs) {
        if (job.state == JobState::failed) {
          EXPECT_THAT(job.error, HasSubstr("was interrupted"));
          EXPECT_TRUE((*store)->retry(job.id));
        }
      }
    }
  }
  const auto last = Process(command(-1, 0)).wait();
  EXPECT_THAT(last.out, HasSubstr("all done"));
  const auto store = CaseStore::open(folder / "store", clock, "test");
  ASSERT_TRUE(store);
  expect_intact(**store, told);
  for (const auto& [id, number] : told.saved) {
    EXPECT_EQ((*store)->case_of(id)->state, CaseState::done) << number;
  }
  EXPECT_FALSE(fs::exists(folder / "claim.twice"));
  RecordProperty("cases_saved", static_cast<int>(told.saved.size()));
}

/// Takes all but `free` bytes of the file system.
void fill(const fs::path& file, std::uint64_t free) {
  const std::uint64_t bytes = *free_space_bytes(file.parent_path()) - free;
  std::ofstream(file) << std::string(bytes, 'x');
}

/// How far a case came before the disk was full.
struct Reached {
  bool opened = false;
  bool saved = false;
  bool made = false;
};

/// One case on a disk with this much space, then the space is freed and the case is made.
Reached live_on(const fs::path& disk, std::uint64_t free) {
  const fs::path folder = disk / "store";
  fs::remove_all(folder);
  fill(disk / "ballast", free);
  const SystemClock clock;
  const StepChain chain = fake_chain(R"({"bytes": 100000})", R"({"bytes": 100000})");
  Reached reached;
  std::optional<Case> saved;
  auto store = CaseStore::open(folder, clock, "test");
  reached.opened = store.has_value();
  if (store) {
    const auto scanned = skullstation::testing::scan_fake_case(**store, "a", chain);
    reached.saved = scanned.has_value();
    if (scanned) saved = *scanned;
    JobEngine engine(**store, fake_engine_options(chain), [](JobNews, std::int64_t) {});
    EXPECT_TRUE(skullstation::testing::comes_true([&] {
      const auto left = (*store)->outstanding();
      return !engine.trouble().empty() || (left && left->empty());
    }));
    reached.made = saved && (*store)->case_of(saved->id)->state == CaseState::done;
    EXPECT_THAT((*store)->damage(true), IsEmpty()) << free;
  }
  if (store) store->reset();  // the station goes down with a full disk,
  fs::remove(disk / "ballast");
  store = CaseStore::open(folder, clock, "test");  // and comes back with space
  EXPECT_TRUE(store) << free << ": " << store.error().message();
  if (!store) return reached;
  EXPECT_THAT((*store)->damage(true), IsEmpty()) << free;
  if (!saved) {
    if (const auto unfinished = *(*store)->unfinished_scan()) {
      EXPECT_TRUE((*store)->give_up_scan(unfinished->id));
    }
    const auto scanned = skullstation::testing::scan_fake_case(**store, "b", chain);
    EXPECT_TRUE(scanned) << free << ": " << scanned.error().message();
    if (!scanned) return reached;
    saved = *scanned;
  }
  const auto jobs = *(*store)->jobs(saved->id);
  for (const Job& job : jobs) {
    if (job.state == JobState::failed) {
      EXPECT_TRUE((*store)->retry(job.id)) << job.error;
    }
  }
  JobEngine engine(**store, fake_engine_options(chain), [](JobNews, std::int64_t) {});
  EXPECT_TRUE(skullstation::testing::comes_true([&] {
    return (*store)->case_of(saved->id)->state == CaseState::done;
  })) << free
      << ": " << engine.trouble();
  return reached;
}

TEST(JobsCrash, AFullDiskLosesNothingWhateverWriteItHits) {
  const TemporaryFolder folder;
  constexpr std::uint64_t disk_bytes = 4 << 20;
  const bool allowed = testing::on_small_disk(folder.path(), disk_bytes, [&] {
    int opened = 0;
    int saved = 0;
    int made = 0;
    int rounds = 0;
    for (std::uint64_t free = 0; free <= 800'000; free += 16'384, ++rounds) {
      const Reached reached = live_on(folder.path(), free);
      opened += reached.opened ? 1 : 0;
      saved += reached.saved ? 1 : 0;
      made += reached.made ? 1 : 0;
      if (::testing::Test::HasFailure()) return;
    }
    // The disk was full at each of the stages.
    EXPECT_LT(opened, rounds);
    EXPECT_LT(saved, opened);
    EXPECT_LT(made, saved - 1);
    EXPECT_GT(made, 0);
  });
  if (!allowed) GTEST_SKIP() << "a file system can't be mounted here (neither root nor namespaces)";
}

}  // namespace
}  // namespace skullstation
