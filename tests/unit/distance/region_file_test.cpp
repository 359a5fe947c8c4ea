#include "reconstruction/distance/region_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

Result<std::vector<bool>> region_from(const std::string& text) {
  const TemporaryFolder folder;
  EXPECT_TRUE(write_file_durably(folder / "face.txt", text));
  return read_region(folder / "face.txt", 5);
}

TEST(RegionFile, NumbersBecomeFlags) {
  const auto region = region_from("# the face\n0\n\n3  # nose\r\n");
  ASSERT_TRUE(region) << region.error().message();
  EXPECT_EQ(*region, (std::vector<bool>{true, false, false, true, false}));
}

TEST(RegionFile, EveryDefectIsNamedWithItsLine) {
  EXPECT_THAT(region_from("1\nx\n").error().message(), HasSubstr("line 2: one vertex number"));
  EXPECT_THAT(region_from("1 2\n").error().message(), HasSubstr("line 1: one vertex number"));
  EXPECT_THAT(region_from("5\n").error().message(), HasSubstr("vertex 5 of 5 does not exist"));
  EXPECT_THAT(region_from("-1\n").error().message(), HasSubstr("does not exist"));
  EXPECT_THAT(region_from("1\n1\n").error().message(),
              HasSubstr("line 2: vertex 1 is named twice"));
  EXPECT_THAT(region_from("# none\n").error().message(), HasSubstr("names no vertex"));
  EXPECT_FALSE(read_region("/nowhere/face.txt", 5));
}

}  // namespace
}  // namespace skullstation
