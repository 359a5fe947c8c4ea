#include "core/nearest_word.h"

#include <gtest/gtest.h>

namespace skullstation {
namespace {

TEST(NearestWord, FindsTheTypo) {
  const std::vector<std::string> known{"exposure_us", "gain", "white_balance_k"};
  EXPECT_EQ(nearest_word("exposure_ms", known), "exposure_us");
  EXPECT_EQ(nearest_word("exposure", known), "exposure_us");
  EXPECT_EQ(nearest_word("gian", known), "gain");
  EXPECT_EQ(nearest_word("white", known), "white_balance_k");
}

TEST(NearestWord, ProposesNothingFarFetched) {
  EXPECT_EQ(nearest_word("shutter", {"exposure_us", "gain"}), "");
  EXPECT_EQ(nearest_word("x", {}), "");
}

}  // namespace
}  // namespace skullstation
