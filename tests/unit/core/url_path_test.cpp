#include "core/url_path.h"

#include <gtest/gtest.h>

namespace skullstation {
namespace {

TEST(UrlPath, KeepsWhatAddressesMayHoldAndEscapesTheRest) {
  EXPECT_EQ(url_path("2026-0042_ab/data/case/report~1.pdf"), "2026-0042_ab/data/case/report~1.pdf");
  EXPECT_EQ(url_path("tissue_1_+2 100%.glb"), "tissue_1_%2B2%20100%25.glb");
  EXPECT_EQ(url_path("a?b#c:d\\e"), "a%3Fb%23c%3Ad%5Ce");
  EXPECT_EQ(url_path("Schädel"), "Sch%C3%A4del");
  EXPECT_EQ(url_path(""), "");
}

}  // namespace
}  // namespace skullstation
