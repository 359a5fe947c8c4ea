#include "daemon/case/known_depths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

Result<std::vector<KnownDepth>> parsed(std::string_view text) {
  return parse_known_depths(text, "depths.csv", testing::skull_template());
}

TEST(KnownDepths, AreReadWithHeadingCommentsAndWindowsLineEnds) {
  const auto depths =
      parsed("landmark,depth_mm,sd_mm\r\n# by ultrasound\r\n\r\nnasion, 6.5, 0.4\r\n");
  ASSERT_TRUE(depths) << depths.error().message();
  ASSERT_EQ(depths->size(), 1U);
  EXPECT_EQ(depths->front().depth_mm, 6.5);
  EXPECT_EQ(depths->front().sd_mm, 0.4);
  EXPECT_EQ(depths->front().bone.corners, testing::skull_template().landmarks[0].place.corners);
}

TEST(KnownDepths, WithoutADeviationAreAMillimetreUncertain) {
  EXPECT_EQ(parsed("nasion,6")->front().sd_mm, 1.0);
}

TEST(KnownDepths, NameTheLineThatIsWrong) {
  EXPECT_THAT(parsed("nasion,6\nnasoin,6\n").error().message(),
              ::testing::AllOf(HasSubstr("depths.csv:2"), HasSubstr("did you mean \"nasion\"")));
  EXPECT_THAT(parsed("nasion,6\nnasion,six\n").error().message(), HasSubstr("no number"));
  EXPECT_THAT(parsed("nasion,6,1,2\n").error().message(), HasSubstr("depths.csv:1"));
  EXPECT_THAT(parsed("# nothing\n").error().message(), HasSubstr("holds no depth"));
  EXPECT_THAT(parsed("").error().message(), HasSubstr("holds no depth"));
}

}  // namespace
}  // namespace skullstation
