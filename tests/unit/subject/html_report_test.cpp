#include "daemon/report/html_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HtmlReport, Base64AsInRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(HtmlReport, TextStaysText) {
  HtmlReport report("A & B");
  report.add_warning("<script>", "\"quoted\"");
  report.add_table({{"1 < 2", "<b>"}});
  const std::string page = report.page();
  EXPECT_THAT(page, HasSubstr("<title>A &amp; B</title>"));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(page, HasSubstr("&quot;quoted&quot;"));
  EXPECT_THAT(page, HasSubstr("<td>1 &lt; 2</td><td>&lt;b&gt;</td>"));
  EXPECT_THAT(page, Not(HasSubstr("<script>")));
}

TEST(HtmlReport, PicturesAreInThePage) {
  HtmlReport report("pictures");
  report.add_pictures({{"grey", Image8(8, 8, 3, 128)}});
  EXPECT_THAT(report.page(), HasSubstr("src=\"data:image/jpeg;base64,/9j/"));
  EXPECT_THAT(report.page(), HasSubstr("<figcaption>grey</figcaption>"));
}

}  // namespace
}  // namespace skullstation
