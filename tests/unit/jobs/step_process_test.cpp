#include "daemon/jobs/step_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "core/file.h"
#include "tests/support/station_client.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using skullstation::testing::comes_true;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

class StepProcessTest : public ::testing::Test {
 protected:
  StepProcess process(const std::string& options) {
    const std::string request = R"({"inputs": {}, "out": ")" + (folder_ / "out").string() +
                                R"(", "options": )" + options + "}";
    EXPECT_TRUE(write_file_durably(folder_ / "request.json", request));
    StepProcess made;
    made.command = testing::fake_step_command();
    made.command.insert(made.command.end(), {"step", folder_.path().string()});
    made.folder = folder_.path();
    made.log = folder_ / "log.txt";
    made.limits = testing::fake_chain().front().limits;
    made.lock = folder_ / "step.lock";
    made.grace = 50ms;
    made.on_line = [this](std::string_view line) { lines_.emplace_back(line); };
    return made;
  }

  /// How it ended, in words.
  std::string end_of(const StepProcess& made) {
    const auto end = run_step_process(made, {});
    EXPECT_TRUE(end) << end.error().message();
    return end ? end_in_words(*end, made.limits) : "";
  }

  TemporaryFolder folder_;
  std::vector<std::string> lines_;
};

TEST_F(StepProcessTest, ASoundStepEndsWithoutWordsAndItsLinesAreHeard) {
  EXPECT_EQ(end_of(process("{}")), "");
  EXPECT_EQ(*read_file(folder_ / "out" / "made.txt"), "step()");
  ASSERT_EQ(lines_.size(), 1U);
  EXPECT_THAT(lines_[0], HasSubstr("half way"));
}

TEST_F(StepProcessTest, EachWayToFailHasItsWords) {
  EXPECT_THAT(end_of(process(R"({"do": "fail", "code": 5})")), HasSubstr("ended with code 5"));
  EXPECT_THAT(*read_file(folder_ / "log.txt"), HasSubstr("made of cheese"));
  EXPECT_EQ(end_of(process(R"({"do": "segfault"})")), "crashed: signal 11 (Segmentation fault)");
  EXPECT_THAT(end_of(process(R"({"do": "big file"})")), HasSubstr("larger than it may"));
}

TEST_F(StepProcessTest, MemoryIsLimited) {
  EXPECT_THAT(end_of(process(R"({"do": "eat memory"})")), HasSubstr("signal 6"));
  EXPECT_THAT(*read_file(folder_ / "log.txt"), HasSubstr("bad_alloc"));
}

TEST_F(StepProcessTest, TimeIsLimitedEvenIfTheStepWontListen) {
  auto hangs = process(R"({"do": "hang"})");
  hangs.limits.time = 1s;
  EXPECT_THAT(end_of(hangs), HasSubstr("took longer than 1 min"));
}

TEST_F(StepProcessTest, CpuTimeIsLimited) {
  auto spins = process(R"({"do": "spin"})");
  spins.limits.cpu_time = 1s;
  spins.limits.time = 10min;  // of a crowded machine
  EXPECT_THAT(end_of(spins), HasSubstr("CPU time"));
}

TEST_F(StepProcessTest, ThereIsNoNetwork) {
  EXPECT_EQ(end_of(process(R"({"do": "network"})")), "");
  EXPECT_EQ(*read_file(folder_ / "out" / "made.txt"), "no network, none at all");
}

TEST_F(StepProcessTest, UnlessItNeedsOne) {
  auto asks = process(R"({"do": "network"})");
  asks.limits.network = true;
  EXPECT_EQ(end_of(asks), "");
  EXPECT_EQ(*read_file(folder_ / "out" / "made.txt"), "network, some");
}

TEST_F(StepProcessTest, ItCanBeStopped) {
  std::stop_source stop;
  auto sleeps = process(R"({"sleep_ms": 20000})");
  sleeps.on_line = [&stop](std::string_view) { stop.request_stop(); };
  const auto end = run_step_process(sleeps, stop.get_token());
  ASSERT_TRUE(end) << end.error().message();
  EXPECT_EQ(end->how, StepEnd::How::stopped);
  EXPECT_LT(end->seconds, 10.0);
}

TEST_F(StepProcessTest, WhatAStepLeavesRunningIsEndedWithIt) {
  EXPECT_EQ(end_of(process(R"({"do": "leave a child"})")), "");
  // The next one gets the lock, which the child would hold.
  EXPECT_EQ(end_of(process("{}")), "");
}

TEST_F(StepProcessTest, TwoNeverRunAtOnce) {
  const std::string claims =
      R"({"sleep_ms": 100, "claim": ")" + (folder_ / "claim").string() + "\"}";
  const StepProcess first = process(claims);
  StepProcess second = first;
  second.on_line = [](std::string_view) {};
  std::string end_of_second;
  std::jthread other([&] { end_of_second = end_of(second); });
  EXPECT_EQ(end_of(first), "");
  other.join();
  EXPECT_EQ(end_of_second, "");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "claim.twice"));
}

TEST_F(StepProcessTest, AProgramThatIsNotThereIsNamed) {
  auto missing = process("{}");
  missing.command[0] = (folder_ / "none").string();
  const auto end = run_step_process(missing, {});
  ASSERT_FALSE(end);
  EXPECT_THAT(end.error().message(), HasSubstr("none: can't be used (No such file"));
}

}  // namespace
}  // namespace skullstation
