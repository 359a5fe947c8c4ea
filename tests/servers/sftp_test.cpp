// SFTP: OpenSSH's server.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/servers/servers.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Sftp : public Servers {
 protected:
  void SetUp() override { need({"/usr/sbin/sshd", "/usr/bin/ssh-keygen"}); }
  TargetConfig sftp(int port = 12222) {
    TargetConfig config = target(DeliveryProtocol::sftp,
                                 "sftp://localhost:" + std::to_string(port) + make("in").string());
    config.user = "root";
    config.key_file = folder_ / "id";
    config.host_key_sha256 = fingerprint_of(folder_ / "host.pub");
    return config;
  }
};

TEST_F(Sftp, HoldsThePackageOnceThoughSentThreeTimes) {
  const auto server = start_sshd(folder_.path());
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(sftp()), "");
  expect_whole_package(folder_ / "in");
  EXPECT_EQ(probe(sftp(), true), "");
  expect_whole_package(folder_ / "in");
  change_byte(folder_ / "in" / package().remote_name() / "bag-info.txt", 3, 1);
  EXPECT_THAT(fails(sftp(), ErrorKind::bad_input), HasSubstr("holds other bytes"));
}

TEST_F(Sftp, AnotherHostKeyIsToldNothingAndAnotherUserKeyIsRefused) {
  const auto server = start_sshd(folder_.path());
  TargetConfig config = sftp();
  config.host_key_sha256 = "SHA256:" + std::string(43, 'A');
  EXPECT_THAT(fails(config, ErrorKind::hardware), HasSubstr("shows another host key"));
  fs::copy(folder_ / "host", folder_ / "other");
  config = sftp();
  config.key_file = folder_ / "other";
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("refuses the login"));
  ::chmod((folder_ / "id").c_str(), 0640);
  EXPECT_THAT(fails(sftp(), ErrorKind::bad_input), HasSubstr("that others may read"));
  EXPECT_TRUE(fs::is_empty(folder_ / "in"));
}

TEST_F(Sftp, CutConnectionsLoseAndDoubleNothing) {
  const auto server = start_sshd(folder_.path());
  survives_cuts(sftp(18501), 18501, 12222, 2'000'000);
  expect_whole_package(folder_ / "in");
}

TEST_F(Sftp, AFullDiskWaits) {
  const auto server = start_sshd(folder_.path());
  if (!make_small_disk("in", "256k")) return;
  EXPECT_NE(fails(sftp(), ErrorKind::hardware), "it was delivered");
}

}  // namespace
}  // namespace skullstation::testing
