#include "daemon/jobs/blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

class BlobStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "session" / "images");
    ASSERT_TRUE(write_file_durably(folder_ / "session" / "session.json", "{}"));
    ASSERT_TRUE(write_file_durably(folder_ / "session" / "images" / "0.png", "picture"));
    ASSERT_TRUE(write_file_durably(folder_ / "session" / "images" / "1.png", "picture"));
  }
  BlobStore open() { return *BlobStore::open(folder_ / "blobs"); }
  std::vector<ArtifactFile> take() {
    auto taken = open().take(folder_ / "session");
    EXPECT_TRUE(taken) << taken.error().message();
    return taken.value_or(std::vector<ArtifactFile>{});
  }
  /// As a failing disk would, behind the store's back.
  void rot(const std::string& sha256) {
    const fs::path blob = open().path_of(sha256);
    fs::remove(blob);
    std::ofstream(blob) << "pictura";
  }

  TemporaryFolder folder_{testing::Medium::memory};
};

TEST_F(BlobStoreTest, FilesGoInByContentAndComeOutByName) {
  const auto files = take();
  ASSERT_EQ(files.size(), 3U);
  EXPECT_EQ(files[0].path, "images/0.png");
  EXPECT_EQ(files[0].sha256, sha256_hex("picture"));
  EXPECT_EQ(files[0].bytes, 7U);
  EXPECT_EQ(files[0].sha256, files[1].sha256) << "the same content is kept once";
  ASSERT_TRUE(open().lay_out(files, folder_ / "again"));
  EXPECT_EQ(*read_file(folder_ / "again" / "images" / "1.png"), "picture");
  EXPECT_EQ(fs::status(folder_ / "again" / "session.json").permissions() & fs::perms::owner_write,
            fs::perms::none);
}

TEST_F(BlobStoreTest, TakingTheSameAgainIsNoHarm) {
  const auto once = take();
  EXPECT_EQ(take(), once);
}

TEST_F(BlobStoreTest, ADamagedBlobIsNamedAndMendedByASoundCopy) {
  const auto files = take();
  rot(files[0].sha256);
  EXPECT_TRUE(open().check(files[0], false)) << "its size is as it was";
  EXPECT_THAT(open().check(files[0], true).error().message(), HasSubstr("is damaged: images/0"));
  EXPECT_THAT(open().lay_out(files, folder_ / "again").error().message(), HasSubstr("is damaged"));
  fs::remove(open().path_of(files[2].sha256));
  EXPECT_THAT(open().check(files[2], false).error().message(), HasSubstr("is missing: session"));
  take();
  for (const ArtifactFile& file : files) EXPECT_TRUE(open().check(file, true));
}

TEST_F(BlobStoreTest, LinksAreRefused) {
  fs::create_symlink("/etc/passwd", folder_ / "session" / "passwd");
  const auto taken = open().take(folder_ / "session");
  ASSERT_FALSE(taken);
  EXPECT_THAT(taken.error().message(), HasSubstr("passwd: is a link"));
}

TEST_F(BlobStoreTest, WhatNobodyNamesIsRemoved) {
  const auto files = take();
  std::ofstream(folder_ / "blobs" / "00" / "half.part") << "x";
  const BlobStore store = open();
  EXPECT_FALSE(fs::exists(folder_ / "blobs" / "00" / "half.part"));
  EXPECT_EQ(store.remove_all_but({files[0].sha256}).value_or(-1), 1);
  EXPECT_TRUE(store.check(files[0], true));
  EXPECT_FALSE(store.check(files[2], true));
}

}  // namespace
}  // namespace skullstation
