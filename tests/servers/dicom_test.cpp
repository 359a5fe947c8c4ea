// DICOM C-STORE over TLS: Orthanc.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "tests/servers/servers.h"

namespace skullstation::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Dicom : public Servers {
 protected:
  void SetUp() override { need({"/usr/sbin/Orthanc"}); }
  TargetConfig dicom(int port = 14242) {
    TargetConfig config = with_certificate(
        target(DeliveryProtocol::dicom, "dicoms://localhost:" + std::to_string(port)));
    config.called_ae = "CASEPACS";
    config.calling_ae = "STATION01";
    return config;
  }
  TargetConfig plain() {
    TargetConfig config = target(DeliveryProtocol::dicom, "dicom://localhost:14242");
    config.called_ae = "CASEPACS";
    config.calling_ae = "STATION01";
    return config;
  }
};

TEST_F(Dicom, OrthancHoldsTheStudyOnceOverTls) {
  const auto server = start_orthanc(folder_.path(), true);
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(dicom()), "");
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "db")) {
    const bool whole = entry.is_regular_file() && entry.path().filename().string().size() == 36 &&
                       read_file(entry.path()).value().substr(128, 4) == "DICM";
    files += whole ? 1 : 0;
  }
  EXPECT_EQ(files, std::ssize(objects(dicom())));
  EXPECT_EQ(probe(dicom(), false), "");
  EXPECT_EQ(probe(dicom(), false), "") << "the same probe twice";
}

TEST_F(Dicom, OtherBytesUnderTheSameUidAreFoundThoughOrthancSaysSuccess) {
  const auto server = start_orthanc(folder_.path(), false);
  ASSERT_EQ(arrives(plain()), "");
  auto changed = objects(plain());
  std::string bytes = read_file(changed[0].file).value();
  bytes[bytes.size() - 60] ^= 1;
  ASSERT_TRUE(write_file_durably(changed[0].file, bytes));
  const auto opened = open_target(plain()).value();
  ASSERT_TRUE(opened->put(changed[0], {})) << "it says Success";
  changed[0].sha256 = std::string(64, 'f');
  const auto sent = deliver_objects(*opened, {changed[0]});
  ASSERT_FALSE(sent);
  EXPECT_THAT(sent.error().message(), HasSubstr("holds other bytes"));
}

TEST_F(Dicom, WhoIsNotKnownIsRefused) {
  {
    const auto server = start_orthanc(folder_.path(), true);
    TargetConfig config = dicom();
    config.ca_file = certificates().rogue();
    EXPECT_NE(fails(config, ErrorKind::hardware), "it was delivered");
    config = dicom();
    config.certificate_file = certificates().rogue();
    config.key_file = certificates().rogue_key();
    EXPECT_NE(fails(config, ErrorKind::hardware), "it was delivered");
    EXPECT_NE(fails(plain(), ErrorKind::hardware), "it was delivered");
    config = dicom();
    config.called_ae = "SOMEBODY";
    EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("refuses to talk to STATION01"));
    config = dicom();
    config.calling_ae = "STRANGER";
    EXPECT_THAT(fails(config, ErrorKind::hardware), HasSubstr("knows this station's AE title"));
  }
  EXPECT_THAT(fails(dicom(), ErrorKind::hardware), HasSubstr("does not answer"));
}

TEST_F(Dicom, CutConnectionsLoseAndDoubleNothing) {
  const auto server = start_orthanc(folder_.path(), true);
  survives_cuts(dicom(18502), 18502, 14242, 2'000'000);
}

TEST_F(Dicom, AFullDiskWaits) {
  if (!make_small_disk("db", "1m")) return;
  {
    const auto server = start_orthanc(folder_.path(), true);
    EXPECT_THAT(fails(dicom(), ErrorKind::hardware), HasSubstr("has no room"));
  }
}

}  // namespace
}  // namespace skullstation::testing
