#include "tests/support/small_disk.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>

namespace skullstation::testing {

namespace {

constexpr auto ballast_name = "ballast";

}  // namespace

bool on_small_disk(const std::filesystem::path& folder, std::uint64_t bytes,
                   const std::function<void()>& body) {
  constexpr int not_allowed = 77;
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const int spaces = CLONE_NEWNS | (::geteuid() == 0 ? 0 : CLONE_NEWUSER);
    if (::unshare(spaces) != 0 ||
        ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", folder.c_str(), "tmpfs", 0,
                fmt::format("size={},mode=700", bytes).c_str()) != 0) {
      ::_exit(not_allowed);
    }
    body();
    std::fflush(nullptr);
    ::_exit(::testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == not_allowed) return false;
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "see above";
  return true;
}

void resize_disk(const std::filesystem::path& folder, std::uint64_t bytes) {
  std::filesystem::remove(folder / ballast_name);
  const int resized = ::mount("tmpfs", folder.c_str(), "tmpfs", MS_REMOUNT,
                              fmt::format("size={},mode=700", bytes).c_str());
  EXPECT_EQ(resized, 0) << folder;
}

void leave_no_space(const std::filesystem::path& folder) {
  // What is being written meanwhile makes the kernel refuse: another try.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    struct statvfs disk {};
    ASSERT_EQ(::statvfs(folder.c_str(), &disk), 0);
    const std::uint64_t used = (disk.f_blocks - disk.f_bfree) * disk.f_frsize;
    if (::mount("tmpfs", folder.c_str(), "tmpfs", MS_REMOUNT,
                fmt::format("size={},mode=700", used).c_str()) == 0) {
      break;
    }
    ASSERT_LT(attempt, 999) << folder << " can't be made smaller";
  }
  // The kernel counts roughly: what it still gives is taken.
  std::ofstream ballast(folder / ballast_name, std::ios::app);
  while (ballast << std::string(4096, 'x') << std::flush) {
  }
}

}  // namespace skullstation::testing
