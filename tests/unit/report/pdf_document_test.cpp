#include "daemon/report/pdf_document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

int pages_of(const std::string& pdf) {
  int pages = 0;
  for (std::size_t at = pdf.find("/Type /Page\n"); at != std::string::npos;
       at = pdf.find("/Type /Page\n", at + 1)) {
    ++pages;
  }
  return pages;
}

Report long_report() {
  Report report{"Approximation of M\xc3\xbcller \xe2\x80\x93 draft", {}};
  report.add(Warning{"model", "Made of phantoms."});
  report.add(Heading{"Pictures"});
  report.add(Pictures{CaptionedPictures(10, {"grey", Image8(40, 50, 3, 128)})});
  report.add(Table{{{"skull", std::string(300, 'x')}, {"seed", "1"}}});
  report.add(ErrorBars{std::vector<ErrorBars::Row>(30, {"g-g'", {5.0, 1.0}, {6.0, 2.0}}), "mm",
                       "model", "T-Table"});
  for (int i = 0; i < 40; ++i) {
    report.add(
        Paragraph{"A sentence that is long enough for more than one line of a page, so that "
                  "the words have to be broken somewhere between two of them."});
  }
  return report;
}

TEST(PdfDocument, BreaksALongReportIntoPages) {
  const auto pdf = pdf_document(long_report());
  ASSERT_TRUE(pdf) << pdf.error().message();
  EXPECT_THAT(*pdf, StartsWith("%PDF-1."));
  EXPECT_THAT(*pdf, HasSubstr("%%EOF"));
  EXPECT_THAT(*pdf, HasSubstr("/DCTDecode"));
  EXPECT_GE(pages_of(*pdf), 3);
  EXPECT_LE(pages_of(*pdf), 6);
}

TEST(PdfDocument, TheSameReportGivesTheSameBytes) {
  EXPECT_EQ(*pdf_document(long_report()), *pdf_document(long_report()));
}

TEST(PdfDocument, AnEmptyReportIsAPageWithItsTitle) {
  const auto pdf = pdf_document({"Nothing", {}});
  ASSERT_TRUE(pdf);
  EXPECT_EQ(pages_of(*pdf), 1);
}

}  // namespace
}  // namespace skullstation
