#include "daemon/evidence/block_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"

namespace skullstation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

FileDigest digest_of(std::string_view text) {
  FileDigest digest;
  digest.bytes = text.size();
  for (; !text.empty(); text.remove_prefix(std::min<std::size_t>(block_bytes, text.size()))) {
    digest.block_sha256.push_back(sha256_hex(text.substr(0, block_bytes)));
  }
  return digest;
}

std::vector<ByteRange> ranges(const std::string& before, const std::string& after) {
  return changed_ranges(digest_of(before), digest_of(after));
}

TEST(BlockList, ReadsWhatItWrites) {
  const std::map<std::string, FileDigest> files = {
      {"data/empty", digest_of("")},
      {"data/two %", digest_of(std::string(block_bytes + 1, 'x'))},
      {"data/whole", digest_of(std::string(block_bytes, 'x'))}};
  const std::string text = format_block_list(files);
  EXPECT_EQ(parse_block_list(text, "blocks").value(), files);
  EXPECT_THAT(text, HasSubstr("path data/empty\nbytes 0\npath data/two %25\nbytes 262145\n"));
}

TEST(BlockList, NamesTheLineThatIsWrong) {
  const auto error = [](const std::string& text) {
    const auto files = parse_block_list(text, "blocks");
    return files ? "no error" : files.error().message();
  };
  const std::string sum(64, 'a');
  EXPECT_THAT(error("pth a\nbytes 0\n"), HasSubstr("blocks: line 1: is not \"path\""));
  EXPECT_THAT(error("path a\nbytes 01\n"), HasSubstr("line 2: is not \"bytes\""));
  EXPECT_THAT(error("path a\nbytes -1\n"), HasSubstr("line 2"));
  EXPECT_THAT(error("path a\nbytes 1\n"), HasSubstr("more blocks than there are sums"));
  EXPECT_THAT(error("path a\nbytes 18446744073709551615\n" + sum + "\n"), HasSubstr("more blocks"));
  EXPECT_THAT(error("path a\nbytes 1\n" + std::string(64, 'z') + "\n"), HasSubstr("line 3"));
  EXPECT_THAT(error("path b\nbytes 0\npath a\nbytes 0\n"), HasSubstr("line 3: is out of order"));
  EXPECT_THAT(error("path a\nbytes 0"), HasSubstr("line 2"));
}

TEST(ChangedRanges, AreTheBlocksThatDiffer) {
  const std::string before(5 * block_bytes + 100, 'x');
  std::string after = before;
  EXPECT_THAT(ranges(before, after), ElementsAre());
  after[0] = 'y';
  after[2 * block_bytes] = 'y';
  after[3 * block_bytes + 7] = 'y';
  after.back() = 'y';
  EXPECT_THAT(ranges(before, after),
              ElementsAre(ByteRange{0, block_bytes}, ByteRange{2 * block_bytes, 4 * block_bytes},
                          ByteRange{5 * block_bytes, 5 * block_bytes + 100}));
}

TEST(ChangedRanges, ReachToTheLongerEndWhereTheSizeChanged) {
  const std::string before(2 * block_bytes + 100, 'x');
  EXPECT_THAT(ranges(before, before + "tail"),
              ElementsAre(ByteRange{2 * block_bytes, 2 * block_bytes + 104}));
  EXPECT_THAT(ranges(before, before.substr(0, block_bytes)),
              ElementsAre(ByteRange{block_bytes, 2 * block_bytes + 100}));
  EXPECT_THAT(ranges(before, ""), ElementsAre(ByteRange{0, 2 * block_bytes + 100}));
  EXPECT_THAT(ranges("", "a"), ElementsAre(ByteRange{0, 1}));
}

}  // namespace
}  // namespace skullstation
