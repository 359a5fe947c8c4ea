#include "daemon/jobs/job_engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "tests/support/station_client.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using skullstation::testing::comes_true;
using skullstation::testing::fake_chain;
using skullstation::testing::fake_engine_options;
using skullstation::testing::scan_fake_case;
using skullstation::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class JobEngineTest : public ::testing::Test {
 protected:
  void SetUp() override { open(); }
  void TearDown() override { engine_.reset(); }
  void open() {
    engine_.reset();
    store_.reset();
    auto opened = CaseStore::open(folder_.path(), clock_, "1.2.3");
    ASSERT_TRUE(opened) << opened.error().message();
    store_ = *std::move(opened);
  }
  void start(const StepChain& chain) {
    engine_ = std::make_unique<JobEngine>(*store_, fake_engine_options(chain),
                                          [this](JobNews news, std::int64_t case_id) {
                                            const std::lock_guard lock(mutex_);
                                            news_.emplace_back(news, case_id);
                                          });
  }
  bool told(JobNews news) {
    const std::lock_guard lock(mutex_);
    return std::ranges::any_of(news_, [&](const auto& n) { return n.first == news; });
  }
  Job job(const Case& owner, std::size_t index) { return store_->jobs(owner.id)->at(index); }
  bool ends(const Case& owner) {
    return comes_true([&] {
      const auto state = store_->case_of(owner.id)->state;
      return state != CaseState::building && state != CaseState::scanning;
    });
  }
  std::string made(const Job& of) {
    return *read_file(store_->blob(store_->files(of.id)->front()));
  }

  /// A case whose first step does this; its job after that.
  Job end_of_first(const std::string& options) {
    const StepChain chain = fake_chain(options);
    const auto owner = scan_fake_case(*store_, "a", chain);
    EXPECT_TRUE(owner) << owner.error().message();
    start(chain);
    EXPECT_TRUE(ends(*owner));
    EXPECT_TRUE(comes_true([&] { return told(JobNews::all_ended); }));
    return job(*owner, 1);
  }

  TemporaryFolder folder_{testing::Medium::memory};
  SystemClock clock_;
  std::unique_ptr<CaseStore> store_;
  std::mutex mutex_;
  std::vector<std::pair<JobNews, std::int64_t>> news_;
  std::unique_ptr<JobEngine> engine_;  // last: it tells until it is gone
};

TEST_F(JobEngineTest, AChainIsMadeFromOneArtifactToTheNext) {
  const StepChain chain = fake_chain();
  const auto owner = *scan_fake_case(*store_, "a", chain, 2);
  start(chain);
  ASSERT_TRUE(ends(owner));
  EXPECT_EQ(store_->case_of(owner.id)->state, CaseState::done);
  EXPECT_EQ(made(job(owner, 1)), "first(<a-0><a-1>)");
  EXPECT_EQ(made(job(owner, 2)), "second(first(<a-0><a-1>))");
  const Job first = job(owner, 1);
  EXPECT_EQ(first.version, "1.2.3");
  EXPECT_EQ(first.figures, "{\"letters\": 17}");
  EXPECT_GT(first.seconds, 0.0);
  EXPECT_GT(first.peak_mib, 0.0);
  EXPECT_TRUE(comes_true([&] { return told(JobNews::all_ended); }));
  EXPECT_TRUE(told(JobNews::begun));
  EXPECT_TRUE(told(JobNews::case_done));
  EXPECT_TRUE(fs::is_empty(folder_ / "work")) << "nothing is left behind";
}

TEST_F(JobEngineTest, AStepThatFailsSaysWhyAndTheNextCaseIsMade) {
  const StepChain failing = fake_chain(R"({"do": "fail"})");
  const auto bad = *scan_fake_case(*store_, "bad", failing);
  const auto good = *scan_fake_case(*store_, "good", fake_chain());
  start(fake_chain());
  ASSERT_TRUE(ends(good));
  EXPECT_EQ(store_->case_of(good.id)->state, CaseState::done);
  EXPECT_EQ(store_->case_of(bad.id)->state, CaseState::failed);
  EXPECT_EQ(
      job(bad, 1).error,
      "ended with code 5 (it may use 0.2 GiB of memory); its last words: fake_step: the skull "
      "is made of cheese");
  EXPECT_THAT(job(bad, 1).log, HasSubstr("cheese"));
  EXPECT_TRUE(told(JobNews::case_failed));
}

TEST_F(JobEngineTest, ACrashIsAFailure) {
  const Job job = end_of_first(R"({"do": "segfault"})");
  EXPECT_EQ(job.state, JobState::failed);
  EXPECT_THAT(job.error, HasSubstr("Segmentation fault"));
}

TEST_F(JobEngineTest, TooLittleMemoryIsAFailure) {
  const Job job = end_of_first(R"({"do": "eat memory"})");
  EXPECT_EQ(job.state, JobState::failed);
  EXPECT_THAT(job.error, HasSubstr("bad_alloc"));
}

TEST_F(JobEngineTest, GarbageIsAFailure) {
  const Job job = end_of_first(R"({"do": "garbage"})");
  EXPECT_EQ(job.state, JobState::failed);
  EXPECT_THAT(job.error, HasSubstr("left no made.txt"));
  EXPECT_EQ(job.figures, "");
  EXPECT_TRUE(nlohmann::json::accept(nlohmann::json(job.log).dump())) << "valid UTF-8";
}

TEST_F(JobEngineTest, ALinkIsNoArtifact) {
  const Job job = end_of_first(R"({"do": "link"})");
  EXPECT_EQ(job.state, JobState::failed);
  EXPECT_THAT(job.error, HasSubstr("not a file: passwd"));
}

TEST_F(JobEngineTest, AStepThatHangsIsEnded) {
  StepChain chain = fake_chain(R"({"do": "hang"})");
  chain[0].limits.time = 1s;
  const auto owner = *scan_fake_case(*store_, "a", chain);
  start(chain);
  ASSERT_TRUE(ends(owner));
  EXPECT_THAT(job(owner, 1).error, HasSubstr("took longer than"));
}

TEST_F(JobEngineTest, ADamagedInputIsNotUsed) {
  const StepChain chain = fake_chain();
  const auto owner = *scan_fake_case(*store_, "a", chain);
  const fs::path blob = store_->blob(store_->files(job(owner, 0).id)->front());
  fs::remove(blob);
  std::ofstream(blob) << "<a-7>";
  start(chain);
  ASSERT_TRUE(ends(owner));
  EXPECT_THAT(job(owner, 1).error, HasSubstr("is damaged: images/0.png"));
}

TEST_F(JobEngineTest, APersonCanCancelAndTryAgain) {
  const StepChain chain = fake_chain(R"({"sleep_ms": 15000})");
  const auto owner = *scan_fake_case(*store_, "a", chain);
  start(chain);
  ASSERT_TRUE(comes_true([&] {
    const auto progress = engine_->progress();
    return progress && progress->fraction == 0.5;
  }));
  EXPECT_EQ(engine_->progress()->stage, "half way");
  ASSERT_TRUE(engine_->cancel(job(owner, 1).id));
  ASSERT_TRUE(ends(owner));
  EXPECT_EQ(job(owner, 1).state, JobState::cancelled);
  EXPECT_FALSE(engine_->cancel(job(owner, 1).id)) << "it has ended";
  const auto quick = store_->rerun(owner.id, "first", "{}");
  ASSERT_TRUE(quick) << quick.error().message();
  engine_->wake();
  ASSERT_TRUE(ends(owner));
  EXPECT_EQ(store_->case_of(owner.id)->state, CaseState::done);
}

TEST_F(JobEngineTest, WhatTheEndOfTheProgramInterruptsBeginsAnew) {
  const StepChain chain = fake_chain(R"({"sleep_ms": 300})");
  const auto owner = *scan_fake_case(*store_, "a", chain);
  start(chain);
  ASSERT_TRUE(comes_true([&] { return engine_->progress().has_value(); }));
  open();
  EXPECT_EQ(job(owner, 1).state, JobState::waiting);
  EXPECT_EQ(job(owner, 1).interruptions, 0) << "it was told to go";
  start(chain);
  ASSERT_TRUE(ends(owner));
  EXPECT_EQ(store_->case_of(owner.id)->state, CaseState::done);
}

TEST_F(JobEngineTest, TooLittleSpaceHoldsAStepUpWithoutFailingIt) {
  StepChain chain = fake_chain();
  chain[0].space_bytes = std::uint64_t{1} << 60;
  const auto owner = *scan_fake_case(*store_, "a", chain);
  start(chain);
  ASSERT_TRUE(comes_true([&] { return !engine_->trouble().empty(); }));
  EXPECT_THAT(engine_->trouble(), HasSubstr("the step first of case 1 waits: it may need"));
  EXPECT_EQ(job(owner, 1).state, JobState::waiting);
}

TEST_F(JobEngineTest, TheTimeLeftIsThatOfEarlierRuns) {
  const StepChain chain = fake_chain();
  const auto a = *scan_fake_case(*store_, "a", chain);
  const fs::path out = folder_ / "out";
  fs::create_directories(out);
  const auto had_taken = [&](const Case& owner, std::vector<double> seconds) {
    for (std::size_t i = 0; i < seconds.size(); ++i) {
      const Job next = job(owner, i + 1);
      ASSERT_TRUE(store_->start(next.id));
      StepOutcome outcome;
      outcome.seconds = seconds[i];
      ASSERT_TRUE(store_->finish(next.id, outcome, out));
    }
  };
  had_taken(a, {100.0, 20.0});
  const auto b = *scan_fake_case(*store_, "b", chain);
  had_taken(b, {110.0, 20.0});
  const auto c = *scan_fake_case(*store_, "c", chain);
  had_taken(c, {500.0, 20.0});
  const auto d = *scan_fake_case(*store_, "d", chain);
  const auto e = *scan_fake_case(*store_, "e", chain);
  StepChain far = chain;  // nothing begins
  for (StepKind& kind : far) kind.space_bytes = std::uint64_t{1} << 60;
  start(far);
  EXPECT_EQ(*engine_->time_left(d.id), 130s) << "the medians";
  EXPECT_EQ(*engine_->time_left(e.id), 260s) << "d comes first";
  EXPECT_EQ(*engine_->time_left(a.id), 0s);
  StepChain unknown = chain;
  unknown[1].name = "third";
  const auto f = *scan_fake_case(*store_, "f", unknown);
  EXPECT_EQ(*engine_->time_left(f.id), std::nullopt);
}

}  // namespace
}  // namespace skullstation
