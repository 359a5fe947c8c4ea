// WebDAV over HTTPS with client certificates: nginx and Apache.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/servers/servers.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Webdav : public Servers {
 protected:
  TargetConfig nginx() {
    return with_certificate(target(DeliveryProtocol::webdav, "https://localhost:18444/in/"));
  }
  void SetUp() override {
    need({"/usr/sbin/nginx", "/usr/lib/nginx/modules/ngx_http_dav_ext_module.so"});
    if (!IsSkipped()) make("dav/in");
  }
};

TEST_F(Webdav, NginxHoldsThePackageOnceThoughSentThreeTimes) {
  const auto server = start_nginx(folder_.path(), folder_ / "dav");
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(nginx()), "");
  expect_whole_package(folder_ / "dav/in");
  EXPECT_EQ(probe(nginx(), true), "");
  expect_whole_package(folder_ / "dav/in");
  change_byte(folder_ / "dav/in" / package().remote_name() / "bag-info.txt", 3, 1);
  EXPECT_THAT(fails(nginx(), ErrorKind::bad_input), HasSubstr("holds other bytes"));
}

TEST_F(Webdav, NginxRefusesWhomItDoesNotKnowAndIsRefusedItself) {
  {
    const auto server = start_nginx(folder_.path(), folder_ / "dav");
    TargetConfig config = nginx();
    config.certificate_file = config.key_file = "";
    EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("wants a client certificate"));
    config = nginx();
    config.certificate_file = certificates().rogue();
    config.key_file = certificates().rogue_key();
    EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("client certificate"));
    config = nginx();
    config.ca_file = certificates().rogue();
    EXPECT_THAT(fails(config, ErrorKind::hardware), HasSubstr("certificate is not to be trusted"));
    config.ca_file = folder_ / "none.pem";
    EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("none.pem: can't be read"));
    config = nginx();
    config.address = "https://localhost:18444/elsewhere";
    EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("has no such place"));
  }
  {
    const auto server = start_nginx(folder_.path(), folder_ / "dav", true);
    EXPECT_THAT(fails(nginx(), ErrorKind::hardware), HasSubstr("expired"));
  }
  EXPECT_THAT(fails(nginx(), ErrorKind::hardware), HasSubstr("does not answer"));
  EXPECT_TRUE(fs::is_empty(folder_ / "dav/in"));
}

TEST_F(Webdav, CutConnectionsLoseAndDoubleNothing) {
  const auto server = start_nginx(folder_.path(), folder_ / "dav");
  TargetConfig config = nginx();
  config.address = "https://localhost:18500/in";
  survives_cuts(config, 18500, 18444, 2'000'000);
  expect_whole_package(folder_ / "dav/in");
}

TEST_F(Webdav, AFullDiskWaits) {
  if (!make_small_disk("dav", "256k")) return;
  make("dav/in");
  const auto server = start_nginx(folder_.path(), folder_ / "dav");
  EXPECT_THAT(fails(nginx(), ErrorKind::hardware), HasSubstr("HTTP 50"));
}

TEST_F(Webdav, ApacheHoldsThePackageOnceThoughSentThreeTimes) {
  need({"/usr/sbin/apache2"});
  if (IsSkipped()) return;
  const auto server = start_apache(folder_.path(), folder_ / "dav");
  TargetConfig config = nginx();
  config.address = "https://localhost:18445/in";
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(config), "");
  expect_whole_package(folder_ / "dav/in");
  EXPECT_EQ(probe(config, true), "");
  change_byte(folder_ / "dav/in" / package().remote_name() / "bag-info.txt", 3, 1);
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("holds other bytes"));
}

TEST_F(Webdav, ApacheRefusesWhomItDoesNotKnowAndIsRefusedItself) {
  need({"/usr/sbin/apache2"});
  if (IsSkipped()) return;
  TargetConfig apache = nginx();
  apache.address = "https://localhost:18445/in";
  {
    const auto server = start_apache(folder_.path(), folder_ / "dav");
    TargetConfig config = apache;
    config.certificate_file = config.key_file = "";
    EXPECT_NE(fails(config, ErrorKind::hardware), "it was delivered");
    config = apache;
    config.certificate_file = certificates().rogue();
    config.key_file = certificates().rogue_key();
    EXPECT_NE(fails(config, ErrorKind::hardware), "it was delivered");
    config = apache;
    config.ca_file = certificates().rogue();
    EXPECT_THAT(fails(config, ErrorKind::hardware), HasSubstr("certificate is not to be trusted"));
  }
  EXPECT_THAT(fails(apache, ErrorKind::hardware), HasSubstr("does not answer"));
  EXPECT_TRUE(fs::is_empty(folder_ / "dav/in"));
}

TEST_F(Webdav, ConnectionsToApacheThatAreCutLoseAndDoubleNothing) {
  need({"/usr/sbin/apache2"});
  if (IsSkipped()) return;
  const auto server = start_apache(folder_.path(), folder_ / "dav");
  TargetConfig config = nginx();
  config.address = "https://localhost:18503/in";
  survives_cuts(config, 18503, 18445, 2'000'000);
  expect_whole_package(folder_ / "dav/in");
}

TEST_F(Webdav, AFullDiskOfApacheWaits) {
  need({"/usr/sbin/apache2"});
  if (IsSkipped()) return;
  if (!make_small_disk("dav", "256k")) return;
  make("dav/in");
  const auto server = start_apache(folder_.path(), folder_ / "dav");
  TargetConfig config = nginx();
  config.address = "https://localhost:18445/in";
  EXPECT_NE(fails(config, ErrorKind::hardware), "it was delivered");
}

}  // namespace
}  // namespace skullstation::testing
