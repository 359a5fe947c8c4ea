#include "daemon/evidence/time_stamp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/time_stamp_authority.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

class TimeStampTest : public ::testing::Test {
 protected:
  std::string what(const std::string& answer, std::string_view message,
                   std::string_view query = {}) {
    const auto stamp = read_time_stamp(answer, message, query);
    return stamp ? "a stamp" : stamp.error().what;
  }

  testing::TemporaryFolder folder_;
  testing::TimeStampAuthority authority_{folder_ / "authority"};
  std::string query_ = time_stamp_query("these bytes");
  std::string answer_ = authority_.stamper()(query_).value();
};

TEST_F(TimeStampTest, SaysWhenAndByWhom) {
  const auto stamp = read_time_stamp(answer_, "these bytes", query_);
  ASSERT_TRUE(stamp) << stamp.error().message();
  EXPECT_EQ(stamp->authority, "CN = Authority");
  EXPECT_FALSE(stamp->serial.empty());
  EXPECT_LT(std::chrono::abs(std::chrono::system_clock::now() - stamp->stamped_at),
            std::chrono::minutes(10));
}

TEST_F(TimeStampTest, IsOfTheseBytesAndThisRequestAlone) {
  EXPECT_EQ(what(answer_, "other bytes"), "is of other bytes");
  EXPECT_THAT(what(answer_, "these bytes", time_stamp_query("these bytes")),
              HasSubstr("nonce is another"));
}

TEST_F(TimeStampTest, NoChangeGoesUnnoticedOrEndsTheProgram) {
  int accepted = 0;
  for (std::size_t i = 0; i < answer_.size(); ++i) {
    std::string changed = answer_;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    accepted += read_time_stamp(changed, "these bytes") ? 1 : 0;
  }
  // Bytes that nothing covers: the status' wording, tags without meaning.
  EXPECT_LT(accepted, static_cast<int>(answer_.size()) / 20);
  for (std::size_t size = 0; size < answer_.size(); size += 7) {
    EXPECT_NE(what(answer_.substr(0, size), "these bytes"), "a stamp") << size;
  }
}

TEST_F(TimeStampTest, ARefusalIsTold) {
  // TimeStampResp ::= { status { 2 } }
  EXPECT_THAT(what(std::string("\x30\x05\x30\x03\x02\x01\x02", 7), "these bytes"),
              HasSubstr("the authority refused (status 2)"));
}

TEST_F(TimeStampTest, TrustIsAskedOfTheExaminersCertificates) {
  EXPECT_TRUE(trusts_time_stamp(*read_trust(authority_.certificate()), answer_));
  const testing::TimeStampAuthority other(folder_ / "other");
  const auto distrusted = trusts_time_stamp(*read_trust(other.certificate()), answer_);
  ASSERT_FALSE(distrusted);
  EXPECT_THAT(distrusted.error().message(), HasSubstr("does not lead to a trusted certificate"));
  EXPECT_FALSE(trusts_time_stamp(*read_trust(authority_.certificate()), "no answer"));
}

}  // namespace
}  // namespace skullstation
