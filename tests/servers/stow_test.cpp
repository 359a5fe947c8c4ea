// DICOMweb STOW-RS: Orthanc behind nginx with client certificates.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/servers/servers.h"

namespace skullstation::testing {
namespace {

using ::testing::HasSubstr;

class Stow : public Servers {
 protected:
  void SetUp() override { need({"/usr/sbin/Orthanc", "/usr/sbin/nginx"}); }
  TargetConfig stow() {
    return with_certificate(target(DeliveryProtocol::stow, "https://localhost:18443/dicom-web"));
  }
};

TEST_F(Stow, OrthancBehindNginxHoldsTheStudyOnce) {
  make("dav");
  const auto orthanc = start_orthanc(folder_.path(), false);
  const auto server = start_nginx(folder_.path(), folder_ / "dav");
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(stow()), "");
  EXPECT_EQ(probe(stow(), false), "");
  TargetConfig config = stow();
  config.certificate_file = config.key_file = "";
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("wants a client certificate"));
}

TEST_F(Stow, OtherBytesUnderTheSameUidAreFound) {
  make("dav");
  const auto orthanc = start_orthanc(folder_.path(), false);
  const auto server = start_nginx(folder_.path(), folder_ / "dav");
  EXPECT_THAT(finds_other_bytes(stow(), [](std::string& bytes) { bytes[bytes.size() - 60] ^= 1; }),
              HasSubstr("holds other bytes"));
}

TEST_F(Stow, WhoIsNotKnownIsRefusedAndWhoIsDownIsWaitedFor) {
  make("dav");
  {
    const auto server = start_nginx(folder_.path(), folder_ / "dav");  // nobody behind it
    EXPECT_THAT(fails(stow(), ErrorKind::hardware), HasSubstr("HTTP 502"));
    TargetConfig config = stow();
    config.ca_file = certificates().rogue();
    EXPECT_THAT(fails(config, ErrorKind::hardware), HasSubstr("certificate is not to be trusted"));
  }
  EXPECT_THAT(fails(stow(), ErrorKind::hardware), HasSubstr("does not answer"));
}

TEST_F(Stow, CutConnectionsLoseAndDoubleNothing) {
  make("dav");
  const auto orthanc = start_orthanc(folder_.path(), false);
  const auto server = start_nginx(folder_.path(), folder_ / "dav");
  TargetConfig config = stow();
  config.address = "https://localhost:18505/dicom-web";
  survives_cuts(config, 18505, 18443, 2'000'000);
}

TEST_F(Stow, AFullDiskWaits) {
  make("dav");
  if (!make_small_disk("db", "1m")) return;
  {
    const auto orthanc = start_orthanc(folder_.path(), false);
    const auto server = start_nginx(folder_.path(), folder_ / "dav");
    EXPECT_THAT(fails(stow(), ErrorKind::hardware), HasSubstr("does not hold it"))
        << "what Orthanc answers is no error";
  }
}

}  // namespace
}  // namespace skullstation::testing
