#include "daemon/report/html_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HtmlPage, Base64AsInRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(HtmlPage, TextStaysText) {
  Report report{"A & B", {}};
  report.add(Warning{"<script>", "\"quoted\""});
  report.add(Table{{{"1 < 2", "<b>"}}});
  const std::string page = html_page(report);
  EXPECT_THAT(page, HasSubstr("<title>A &amp; B</title>"));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(page, HasSubstr("&quot;quoted&quot;"));
  EXPECT_THAT(page, HasSubstr("<td>1 &lt; 2</td><td>&lt;b&gt;</td>"));
  EXPECT_THAT(page, Not(HasSubstr("<script>")));
}

TEST(HtmlPage, PicturesAreInThePage) {
  Report report{"pictures", {}};
  report.add(Pictures{{{"grey", Image8(8, 8, 3, 128)}}});
  const std::string page = html_page(report);
  EXPECT_THAT(page, HasSubstr("src=\"data:image/jpeg;base64,/9j/"));
  EXPECT_THAT(page, HasSubstr("<figcaption>grey</figcaption>"));
}

TEST(HtmlPage, ErrorBarsStandBesideTheirReference) {
  Report report{"Chart", {}};
  report.add(ErrorBars{{{"g-g'", {5.0, 1.0}, {6.0, 2.0}}}, "mm", "model", "T-Table"});
  const std::string page = html_page(report);
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("T-Table [mm]"));
  EXPECT_THAT(page, HasSubstr("g-g'"));
  // 8 mm, the reference's upper end, is the chart's right end: 110 + 560.
  EXPECT_THAT(page, HasSubstr("x2=\"670.0\""));
}

}  // namespace
}  // namespace skullstation
