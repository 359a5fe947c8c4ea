#include "core/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

TEST(File, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  const std::string bytes("a\0b\n", 4);
  ASSERT_TRUE(write_file_durably(folder / "f", bytes));
  EXPECT_EQ(read_file(folder / "f"), bytes);
}

TEST(File, AnExistingFileIsReplacedAndNothingElseIsLeft) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file_durably(folder / "f", "old and long"));
  ASSERT_TRUE(write_file_durably(folder / "f", "new"));
  EXPECT_EQ(read_file(folder / "f"), "new");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(File, AFailedWriteLeavesTheOldFile) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file_durably(folder / "f", "old"));
  // The kernel refuses to let any file of this process grow beyond 8 bytes, as a full disk would.
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit tiny{8, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tiny);
  const auto written = write_file_durably(folder / "f", "much longer than eight bytes");
  setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message(), HasSubstr("can't be written"));
  EXPECT_EQ(read_file(folder / "f"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(File, AFolderIsNoFile) {
  const TemporaryFolder folder;
  const auto bytes = read_file(folder.path());
  ASSERT_FALSE(bytes);
  EXPECT_THAT(bytes.error().message(), HasSubstr("is a folder"));
}

TEST(File, AFileInTheWayOfAFolderIsNamed) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file_durably(folder / "f", ""));
  EXPECT_FALSE(make_writable_folder(folder / "f"));
  EXPECT_FALSE(make_writable_folder(folder / "f/below"));
  EXPECT_TRUE(make_writable_folder(folder / "a/b/c"));
}

TEST(File, FreeSpaceOfAMissingFolderIsAnError) {
  EXPECT_GT(free_space_bytes("/tmp").value_or(0), 0U);
  EXPECT_FALSE(free_space_bytes("/nowhere/at/all"));
}

TEST(Sha256, AgreesWithThePublishedVectors) {  // FIPS 180-2, appendix B
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

}  // namespace
}  // namespace skullstation
