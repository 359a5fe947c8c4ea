#include "core/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <thread>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

TEST(ChildProcess, ItsWordsAndExitCodeAreKept) {
  const TemporaryFolder folder;
  const auto code = run_program({"sh", "-c", "echo out; echo err >&2; exit 7"}, folder / "log", {});
  ASSERT_TRUE(code) << code.error().message();
  EXPECT_EQ(*code, 7);
  const auto log = read_file(folder / "log");
  ASSERT_TRUE(log);
  EXPECT_EQ(*log, "out\nerr\n");
}

TEST(ChildProcess, ASignalThatEndsItIsTold) {
  const TemporaryFolder folder;
  const auto code = run_program({"sh", "-c", "kill -9 $$"}, folder / "log", {});
  ASSERT_TRUE(code);
  EXPECT_EQ(*code, 128 + 9);
}

TEST(ChildProcess, AProgramThatIsNotThereIsNamed) {
  const TemporaryFolder folder;
  const auto code = run_program({"no-such-program-here"}, folder / "log", {});
  ASSERT_FALSE(code);
  EXPECT_EQ(code.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(code.error().where, "no-such-program-here");
}

TEST(ChildProcess, AStopRequestEndsItThoughTheSignalIsBlockedHere) {
  sigset_t terminate;
  sigemptyset(&terminate);
  sigaddset(&terminate, SIGTERM);
  sigset_t before;
  pthread_sigmask(SIG_BLOCK, &terminate, &before);
  const TemporaryFolder folder;
  std::stop_source stop;
  std::jthread stopper([&] { stop.request_stop(); });
  const auto code = run_program({"sleep", "600"}, folder / "log", stop.get_token());
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ASSERT_FALSE(code);
  EXPECT_EQ(code.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
