// S3: a double that recomputes every signature (SigV4).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/servers/servers.h"

namespace skullstation::testing {
namespace {

using ::testing::HasSubstr;

class S3 : public Servers {
 protected:
  void SetUp() override { need({"/usr/bin/python3"}); }
  TargetConfig s3() {
    TargetConfig config = target(DeliveryProtocol::s3, "http://127.0.0.1:19000/case/in");
    config.user = "TESTKEY";
    config.secret = secret("test secret / with + signs");
    config.region = "lab";
    return config;
  }
};

TEST_F(S3, HoldsThePackageOnceThoughSentThreeTimesAndChecksSignatures) {
  const auto server = start_s3(folder_.path(), "test secret / with + signs");
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(s3()), "");
  EXPECT_EQ(probe(s3(), true), "");
  TargetConfig config = s3();
  config.secret = secret("wrong");
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("refuses access"));
  config = s3();
  config.address = "http://127.0.0.1:19000/none";
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("has no such place"));
  config.address = "http://127.0.0.1:19000/case/503";
  EXPECT_THAT(fails(config, ErrorKind::hardware), HasSubstr("HTTP 503"));
}

TEST_F(S3, OtherBytesUnderTheSameKeyAreFound) {
  const auto server = start_s3(folder_.path(), "test secret / with + signs");
  EXPECT_THAT(finds_other_bytes(s3(), [](std::string& bytes) { bytes[0] ^= 1; }),
              HasSubstr("holds other bytes"));
}

TEST_F(S3, CutConnectionsLoseAndDoubleNothing) {
  const auto server = start_s3(folder_.path(), "test secret / with + signs");
  TargetConfig config = s3();
  config.address = "http://127.0.0.1:18504/case/in";
  survives_cuts(config, 18504, 19000, 2'000'000);
}

}  // namespace
}  // namespace skullstation::testing
