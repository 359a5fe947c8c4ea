#include "daemon/evidence/bag_manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skullstation {
namespace {

using ::testing::HasSubstr;

const std::string sum(64, 'a');

std::string error(const std::string& text) {
  const auto lines = parse_manifest(text, "manifest");
  return lines ? "no error" : lines.error().message();
}

TEST(BagManifest, ReadsWhatItWrites) {
  const std::vector<ManifestLine> lines = {{"data/100% sure.csv", sum},
                                           {"data/case/head.ply", std::string(64, '0')},
                                           {"data/schädel.ply", sum}};
  const std::string text = format_manifest(lines);
  EXPECT_THAT(text, HasSubstr(sum + "  data/100%25 sure.csv\n"));
  EXPECT_EQ(parse_manifest(text, "m").value(), lines);
  EXPECT_TRUE(parse_manifest("", "m").value().empty());
}

TEST(BagManifest, NamesTheLineThatIsWrong) {
  EXPECT_THAT(error(sum + "  a\n" + sum + " b\n"), HasSubstr("manifest: line 2: is not a SHA-256"));
  EXPECT_THAT(error(std::string(64, 'A') + "  a\n"), HasSubstr("lower-case"));
  EXPECT_THAT(error("abc"), HasSubstr("line feed"));
  EXPECT_THAT(error(sum + "  a\n" + sum + "  a\n"), HasSubstr("twice"));
  EXPECT_THAT(error(sum + "  b\n" + sum + "  a\n"), HasSubstr("out of order"));
  EXPECT_THAT(error(sum + "  a%0Ab\n"), HasSubstr("%25"));
  EXPECT_THAT(error("\n"), HasSubstr("line 1"));
}

TEST(BagManifest, RefusesPathsThatLeaveTheBagOrHideInATerminal) {
  for (const char* path : {"/etc/passwd", "../a", "data/../../a", "a//b", "a/", "~root/a", "",
                           "a/./b", "a\tb", "a\x7f", "a\xff"}) {
    EXPECT_TRUE(unfit_bag_path(path)) << path;
    EXPECT_THAT(error(sum + "  " + path + "\n"), HasSubstr("line 1: names a file")) << path;
  }
  EXPECT_FALSE(unfit_bag_path("data/..a/b..c"));
}

}  // namespace
}  // namespace skullstation
