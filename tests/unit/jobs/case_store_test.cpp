#include "daemon/jobs/case_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>

#include "core/file.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using skullstation::testing::fake_chain;
using skullstation::testing::scan_fake_case;
using skullstation::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CaseStoreTest : public ::testing::Test {
 protected:
  void SetUp() override { open(); }
  void open() {
    store_.reset();
    auto opened = CaseStore::open(folder_.path(), clock_, "1.2.3");
    ASSERT_TRUE(opened) << opened.error().message();
    store_ = *std::move(opened);
  }

  /// Makes a job as the engine would.
  void make(const Job& job, JobState state = JobState::done, const std::string& text = "made") {
    const fs::path out = folder_ / "out";
    fs::create_directories(out);
    fs::remove(out / "made.txt");
    std::ofstream(out / "made.txt") << text;
    ASSERT_TRUE(store_->start(job.id));
    StepOutcome outcome;
    outcome.state = state;
    outcome.seconds = 10.0 * static_cast<double>(job.id);
    if (state == JobState::failed) outcome.error = "no good";
    ASSERT_TRUE(store_->finish(job.id, outcome, out));
  }
  void make_all() {
    while (const auto job = *store_->next_job()) make(*job);
  }
  void set_verified(std::int64_t case_id) {
    const auto verified = store_->set_verified(case_id, store_->jobs(case_id)->back().id);
    ASSERT_TRUE(verified) << verified.error().message();
    EXPECT_TRUE(*verified);
  }
  std::vector<std::string> states(std::int64_t case_id) {
    std::vector<std::string> words;
    const auto jobs = *store_->jobs(case_id);
    for (const Job& job : jobs) {
      words.push_back(job.step + " " + to_string(job.state));
    }
    return words;
  }

  TemporaryFolder folder_{testing::Medium::memory};
  SimulatedClock clock_;
  std::unique_ptr<CaseStore> store_;
};

TEST_F(CaseStoreTest, AScanBecomesACaseWithItsChain) {
  const auto begun = store_->begin_scan("2026-0042");
  ASSERT_TRUE(begun) << begun.error().message();
  EXPECT_EQ(begun->state, CaseState::scanning);
  EXPECT_EQ((*store_->unfinished_scan())->id, begun->id);
  fs::create_directories(store_->scan_folder(begun->id));
  ASSERT_TRUE(write_file_durably(store_->scan_folder(begun->id) / "session.json", "{}"));
  ASSERT_TRUE(store_->save_scan(begun->id, fake_chain()));
  EXPECT_EQ(*store_->unfinished_scan(), std::nullopt);
  EXPECT_FALSE(fs::exists(store_->scan_folder(begun->id)));
  open();  // what was acknowledged is there
  const Case kept = *store_->case_of(begun->id);
  EXPECT_EQ(kept.number, "2026-0042");
  EXPECT_EQ(kept.state, CaseState::building);
  EXPECT_THAT(states(kept.id), ElementsAre("scan done", "first waiting", "second waiting"));
  const auto jobs = *store_->jobs(kept.id);
  EXPECT_EQ(jobs[2].inputs.at("first"), jobs[1].id);
  EXPECT_EQ(jobs[0].version, "1.2.3");
  ASSERT_EQ(store_->files(jobs[0].id)->size(), 1U);
  EXPECT_EQ(store_->files(jobs[0].id)->front().path, "session.json");
  EXPECT_THAT(store_->damage(true), IsEmpty());
}

TEST_F(CaseStoreTest, OneScanAtATime) {
  ASSERT_TRUE(store_->begin_scan("a"));
  EXPECT_FALSE(store_->begin_scan("b"));
  EXPECT_EQ(store_->cases()->size(), 1U) << "the second one left nothing";
}

TEST_F(CaseStoreTest, AScanThatIsGivenUpKeepsItsPictures) {
  const auto begun = store_->begin_scan("a");
  fs::create_directories(store_->scan_folder(begun->id));
  ASSERT_TRUE(store_->give_up_scan(begun->id));
  EXPECT_EQ(*store_->unfinished_scan(), std::nullopt);
  EXPECT_EQ(store_->case_of(begun->id)->state, CaseState::cancelled);
  EXPECT_TRUE(fs::exists(store_->scan_folder(begun->id)));
  EXPECT_FALSE(store_->give_up_scan(begun->id)) << "it is over";
}

TEST_F(CaseStoreTest, TheQueueGoesByPriorityThenAgeThenChain) {
  const auto chain = fake_chain();
  const auto a = *scan_fake_case(*store_, "a", chain);
  const auto b = *scan_fake_case(*store_, "b", chain);
  ASSERT_TRUE(store_->set_priority(b.id, 1));
  std::vector<std::string> order;
  while (const auto job = *store_->next_job()) {
    order.push_back(store_->case_of(job->case_id)->number + " " + job->step);
    make(*job);
  }
  EXPECT_THAT(order, ElementsAre("b first", "b second", "a first", "a second"));
  EXPECT_EQ(store_->case_of(a.id)->state, CaseState::done);
}

TEST_F(CaseStoreTest, AFailureHoldsUpItsOwnCaseOnly) {
  const auto a = *scan_fake_case(*store_, "a", fake_chain());
  const auto b = *scan_fake_case(*store_, "b", fake_chain());
  make(**store_->next_job(), JobState::failed);
  EXPECT_EQ(store_->case_of(a.id)->state, CaseState::failed);
  EXPECT_EQ((*store_->next_job())->case_id, b.id);
  make_all();
  EXPECT_EQ(store_->case_of(b.id)->state, CaseState::done);
  EXPECT_THAT(*store_->outstanding(), IsEmpty());
  EXPECT_THAT(states(a.id), ElementsAre("scan done", "first failed", "second waiting"));

  ASSERT_TRUE(store_->retry(store_->jobs(a.id)->at(1).id));
  EXPECT_EQ(store_->outstanding()->size(), 2U);
  make_all();
  EXPECT_EQ(store_->case_of(a.id)->state, CaseState::done);
  EXPECT_THAT(store_->retry(store_->jobs(a.id)->at(1).id).error().message(),
              HasSubstr("(first): is done; only a failed or cancelled step can be tried again"));
}

TEST_F(CaseStoreTest, ARerunMakesNewArtifactsAndKeepsTheOldOnes) {
  const auto a = *scan_fake_case(*store_, "a", fake_chain());
  make_all();
  const auto before = *store_->jobs(a.id);
  const auto anew = store_->rerun(a.id, "first", R"({"quality": "fine"})");
  ASSERT_TRUE(anew) << anew.error().message();
  EXPECT_EQ(store_->case_of(a.id)->state, CaseState::building);
  const auto after = *store_->jobs(a.id);
  ASSERT_EQ(after.size(), 5U) << "first and what stands on it";
  EXPECT_EQ(after[3].options, R"({"quality": "fine"})");
  EXPECT_EQ(after[3].inputs, before[1].inputs);
  EXPECT_EQ(after[4].inputs.at("first"), after[3].id);
  while (const auto job = *store_->next_job()) make(*job, JobState::done, "finer");
  EXPECT_EQ(*read_file(store_->blob(store_->files(before[1].id)->front())), "made");
  EXPECT_EQ(*read_file(store_->blob(store_->files(after[3].id)->front())), "finer");
  EXPECT_THAT(store_->rerun(a.id, "third", "{}").error().message(), HasSubstr("no such step"));
  EXPECT_FALSE(store_->retry(before[1].id));
}

TEST_F(CaseStoreTest, WhatWaitsCanBeTakenBack) {
  const auto a = *scan_fake_case(*store_, "a", fake_chain());
  ASSERT_TRUE(store_->cancel_waiting((*store_->next_job())->id));
  EXPECT_EQ(store_->case_of(a.id)->state, CaseState::cancelled);
  EXPECT_EQ(*store_->next_job(), std::nullopt);
  EXPECT_THAT(store_->cancel_waiting(store_->jobs(a.id)->at(1).id).error().message(),
              HasSubstr("is cancelled; only a job that waits"));
}

TEST_F(CaseStoreTest, AnInterruptedJobBeginsAnewButNotForEver) {
  const auto a = *scan_fake_case(*store_, "a", fake_chain());
  for (int crash = 1; crash <= 3; ++crash) {
    const auto job = *store_->next_job();
    ASSERT_TRUE(job) << crash;
    EXPECT_EQ(job->interruptions, crash - 1);
    ASSERT_TRUE(store_->start(job->id));
    EXPECT_EQ(*store_->next_job(), std::nullopt) << "one at a time";
    open();
  }
  const Job given_up = store_->jobs(a.id)->at(1);
  EXPECT_EQ(given_up.state, JobState::failed);
  EXPECT_THAT(given_up.error, HasSubstr("was interrupted 3 times"));
  ASSERT_TRUE(store_->retry(given_up.id));
  EXPECT_EQ((*store_->next_job())->interruptions, 0);
}

TEST_F(CaseStoreTest, OnlyWhatWasVerifiedAndExpiredAndIsNotHeldIsDeleted) {
  const auto chain = fake_chain();
  const auto kept = *scan_fake_case(*store_, "never verified", chain);
  const auto held = *scan_fake_case(*store_, "held", chain);
  const auto expired = *scan_fake_case(*store_, "expired", chain);
  make_all();
  set_verified(held.id);
  ASSERT_TRUE(store_->set_hold(held.id, "court order 7"));
  set_verified(expired.id);
  clock_.sleep_for(30h, {});
  const auto building = *scan_fake_case(*store_, "building", chain);
  set_verified(building.id);
  clock_.sleep_for(30h, {});
  const auto young = *scan_fake_case(*store_, "young", {});
  set_verified(young.id);

  EXPECT_THAT(*store_->remove_expired(100h), IsEmpty());
  EXPECT_THAT(*store_->remove_expired(24h), ElementsAre(expired.id));
  EXPECT_THAT(*store_->remove_expired(24h), IsEmpty());
  EXPECT_THAT(*store_->files(store_->jobs(expired.id)->front().id), IsEmpty());
  EXPECT_TRUE(store_->case_of(expired.id)->removed);
  EXPECT_THAT(states(expired.id), ElementsAre("scan done", "first done", "second done"))
      << "what happened stays on record";
  EXPECT_FALSE(store_->files(store_->jobs(kept.id)->front().id)->empty());
  EXPECT_THAT(store_->damage(true), IsEmpty()) << "content shared with other cases is still there";
  EXPECT_THAT(store_->rerun(expired.id, "first", "{}").error().message(),
              HasSubstr("its files were deleted on"));
  ASSERT_TRUE(store_->set_hold(held.id, std::nullopt));
  EXPECT_THAT(*store_->remove_expired(24h), ElementsAre(held.id));
}

TEST_F(CaseStoreTest, AStepOnApprovalIsAppointedOnceForEachResult) {
  StepChain chain = fake_chain();
  StepKind third = chain.back();
  third.name = "third";
  third.inputs = {"scan", "second"};
  third.on_approval = true;
  chain.push_back(third);
  const auto a = *scan_fake_case(*store_, "a", chain);
  EXPECT_THAT(states(a.id), ElementsAre("scan done", "first waiting", "second waiting"));
  EXPECT_THAT(store_->appoint_on_approval(a.id, third, "{}").error().message(),
              HasSubstr("is waiting; \"third\" needs it done"));
  make_all();
  const auto sealing = store_->appoint_on_approval(a.id, third, R"({"by": "x"})");
  ASSERT_TRUE(sealing) << sealing.error().message();
  EXPECT_EQ(*store_->appoint_on_approval(a.id, third, R"({"by": "y"})"), *sealing);
  make_all();
  EXPECT_EQ(*store_->appoint_on_approval(a.id, third, "{}"), *sealing) << "made is made";
  EXPECT_EQ(store_->unverified("third")->size(), 1U);
  EXPECT_TRUE(*store_->set_verified(a.id, *sealing));
  EXPECT_TRUE(store_->case_of(a.id)->verified);
  EXPECT_THAT(*store_->unverified("third"), IsEmpty());

  ASSERT_TRUE(store_->rerun(a.id, "second", "{}", chain));
  EXPECT_FALSE(store_->case_of(a.id)->verified) << "its new result was not delivered";
  EXPECT_FALSE(*store_->set_verified(a.id, *sealing)) << "that is of the old result";
  EXPECT_THAT(states(a.id),
              ElementsAre("scan done", "first done", "second done", "third done", "second waiting"))
      << "a person approves the new result";
  make_all();
  const auto anew = store_->appoint_on_approval(a.id, third, "{}");
  ASSERT_TRUE(anew);
  EXPECT_NE(*anew, *sealing);
  EXPECT_THAT(store_->appoint_on_approval(99, third, "{}").error().message(),
              HasSubstr("there is no such case"));
  third.inputs.emplace_back("fourth");
  EXPECT_THAT(store_->appoint_on_approval(a.id, third, "{}").error().message(),
              HasSubstr("lacks a step that \"third\" needs"));
}

TEST_F(CaseStoreTest, TheFolderIsForOneProcess) {
  const auto second = CaseStore::open(folder_.path(), clock_, "1.2.3");
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message(), HasSubstr("is used by another skullstationd"));
}

TEST_F(CaseStoreTest, AForeignOrDamagedDatabaseIsNamed) {
  store_.reset();
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "station.db").c_str(), &raw), SQLITE_OK);
  sqlite3_exec(raw, "PRAGMA user_version = 9", nullptr, nullptr, nullptr);
  sqlite3_close(raw);
  auto opened = CaseStore::open(folder_.path(), clock_, "1.2.3");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message(),
              HasSubstr("station.db: has format 9; this program knows 1"));
  fs::remove(folder_ / "station.db-wal");
  std::ofstream(folder_ / "station.db") << std::string(8192, 'x');
  opened = CaseStore::open(folder_.path(), clock_, "1.2.3");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message(), HasSubstr("station.db: the database says: file is not a"));
}

TEST_F(CaseStoreTest, DamageIsFound) {
  const auto a = *scan_fake_case(*store_, "a", {});
  const auto files = *store_->files(store_->jobs(a.id)->front().id);
  fs::remove(store_->blob(files[0]));
  EXPECT_THAT(store_->damage(false), ElementsAre(HasSubstr("is missing: images/0.png")));
}

TEST_F(CaseStoreTest, WhatIsWrongWithACasesFilesIsNotedOnce) {
  const auto a = *scan_fake_case(*store_, "a", {});
  const auto b = *scan_fake_case(*store_, "b", {});
  const auto blob = store_->blob(store_->files(store_->jobs(a.id)->front().id)->at(1));
  const auto events = store_->events(a.id)->size();
  EXPECT_THAT(*store_->check_case(a.id, {}), IsEmpty());
  fs::remove(blob);
  std::ofstream(blob) << "<a-7>";  // of the same size
  EXPECT_THAT(*store_->check_case(a.id, {}), ElementsAre(HasSubstr("is damaged: images/1.png")));
  EXPECT_THAT(*store_->check_case(a.id, {}), ElementsAre(HasSubstr("is damaged: images/1.png")));
  EXPECT_THAT(*store_->check_case(b.id, {}), IsEmpty());
  ASSERT_EQ(store_->events(a.id)->size(), events + 1);
  EXPECT_THAT(store_->events(a.id)->back().what, HasSubstr("is damaged: images/1.png"));
}

TEST_F(CaseStoreTest, WhatDoesNotExistIsNamed) {
  EXPECT_THAT(store_->case_of(7).error().message(), HasSubstr("case 7: there is no such case"));
  EXPECT_THAT(store_->retry(7).error().message(), HasSubstr("job 7: there is no such job"));
  EXPECT_THAT(store_->save_scan(7, {}).error().message(), HasSubstr("is not being scanned"));
}

}  // namespace
}  // namespace skullstation
