#include "daemon/evidence/sealed_copy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

TEST(SealedCopy, IsTheFileWithItsSumsForAnySizeAndNumberOfThreads) {
  const testing::TemporaryFolder folder;
  int copies = 0;
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{1}, std::size_t{block_bytes}, std::size_t{16 * block_bytes},
        std::size_t{33 * block_bytes + 5}}) {
    const std::string text = testing::noise(bytes, bytes);
    ASSERT_TRUE(write_file_durably(folder / "from", text));
    for (const int threads : {1, 2, 3}) {
      const auto to = folder / std::to_string(++copies);
      std::uint64_t reported = 0;
      const auto copied = copy_sealed(folder / "from", to, threads, {},
                                      [&](std::uint64_t more) { reported += more; });
      ASSERT_TRUE(copied) << copied.error().message();
      EXPECT_TRUE(read_file(to).value() == text);
      EXPECT_EQ(reported, bytes);
      EXPECT_EQ(copied->bytes, bytes);
      EXPECT_EQ(copied->sha256, sha256_hex(text));
      EXPECT_EQ(copied->block_sha256.size(), (bytes + block_bytes - 1) / block_bytes);
      EXPECT_EQ(*copied, digest_file(to, true, {}).value());
    }
  }
}

TEST(SealedCopy, FollowsNoLinksWaitsForNoPipeAndOverwritesNothing) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write_file_durably(folder / "file", "text"));
  std::filesystem::create_symlink(folder / "file", folder / "link");
  EXPECT_FALSE(copy_sealed(folder / "link", folder / "a", 1, {}));
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(copy_sealed(folder / "pipe", folder / "b", 1, {}).error().message(),
              HasSubstr("no ordinary file"));
  EXPECT_THAT(copy_sealed(folder / "file", folder / "file", 1, {}).error().message(),
              HasSubstr("can't be written"));
  EXPECT_THAT(copy_sealed(folder / "none", folder / "c", 1, {}).error().message(),
              HasSubstr("none: can't be read (No such file"));
  EXPECT_EQ(read_file(folder / "file").value(), "text");
}

TEST(SealedCopy, StopsOnRequest) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write_file_durably(folder / "file", "text"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(copy_sealed(folder / "file", folder / "a", 1, stop.get_token()).error().kind,
            ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
