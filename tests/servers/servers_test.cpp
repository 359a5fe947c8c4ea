// Deliveries to real receivers on a loopback of their own: what arrives, what is refused, what is
// told. SKULLSTATION_LONG=1: with 55 MB instead of 2.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/random.h"
#include "daemon/delivery/delivery.h"
#include "daemon/evidence/package_check.h"
#include "tests/servers/receivers.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/delivery/sealed_case.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace skullstation::testing;
using ::testing::HasSubstr;

/// Why no servers can be started here; empty: they can.
std::string no_network_because;

class OwnNetwork final : public ::testing::Environment {
 public:
  void SetUp() override { no_network_because = enter_own_network(); }
};
const auto* const own_network = ::testing::AddGlobalTestEnvironment(new OwnNetwork);

class Servers : public ::testing::Test {
 protected:
  /// Skips where a program is missing.
  void need(const std::vector<std::string>& programs) {
    if (!no_network_because.empty()) GTEST_SKIP() << no_network_because;
    for (const std::string& program : programs) {
      if (!fs::exists(program)) {
        GTEST_SKIP() << program << " is not installed (tests/servers/packages.txt)";
      }
    }
  }

  static const SealedPackage& package() {
    static const TemporaryFolder folder(Medium::memory);
    static const SealedPackage sealed =
        seal_small_case(folder.path(), long_form() ? 55'000'000 : 2'000'000);
    return sealed;
  }
  std::vector<DeliveryObject> objects(const TargetConfig& target) {
    return objects_for(target, package(), folder_ / "work").value();
  }
  Result<std::string> deliver(const TargetConfig& target) {
    EXPECT_TRUE(target.validate()) << target.validate().error().message();
    auto opened = open_target(target);
    if (!opened) return forward(opened);
    return deliver_objects(**opened, objects(target));
  }
  std::string arrives(const TargetConfig& target) {
    const auto sum = deliver(target);
    if (!sum) return sum.error().message();
    return *sum == sum_of(objects(target)) ? "" : "another sum";
  }
  /// The words of a failure; its kind as wanted.
  std::string fails(const TargetConfig& target, ErrorKind kind) {
    const auto sum = deliver(target);
    if (sum) return "it was delivered";
    EXPECT_EQ(sum.error().kind, kind) << sum.error().message();
    return sum.error().message();
  }
  std::string probe(const TargetConfig& target, bool removed) {
    const auto probed = try_target(target, "ST-01", folder_ / "probe");
    if (!probed) return probed.error().message();
    return probed->removed == removed ? "" : "removed: " + std::to_string(probed->removed);
  }
  fs::path make(const std::string& name) {
    fs::create_directories(folder_ / name);
    return folder_ / name;
  }
  std::string secret(const std::string& text) {
    const auto file = folder_ / ("secret-" + sha256_hex(text).substr(0, 8));
    EXPECT_TRUE(write_file_durably(file, text));
    ::chmod(file.c_str(), 0600);
    return file;
  }
  static TargetConfig target(DeliveryProtocol protocol, const std::string& address) {
    TargetConfig config;
    config.name = "records";
    config.protocol = protocol;
    config.address = address;
    return config;
  }
  static TargetConfig with_certificate(TargetConfig config) {
    config.ca_file = certificates().ca();
    config.certificate_file = certificates().client();
    config.key_file = certificates().client_key();
    return config;
  }
  void expect_whole_package(const fs::path& root) {
    const auto check = check_package(root / package().remote_name(), {});
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_TRUE(check->findings.empty());
    int files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      EXPECT_FALSE(entry.path().string().ends_with(".part")) << entry.path();
      files += entry.is_regular_file() ? 1 : 0;
    }
    EXPECT_EQ(files, std::ssize(package().files)) << "once, and nothing else";
  }
  /// Somebody was there before with other bytes under the name of the first object.
  std::string finds_other_bytes(const TargetConfig& config,
                                const std::function<void(std::string&)>& change) {
    DeliveryObject other = objects(config).front();
    std::string bytes = read_file(other.file).value();
    change(bytes);
    other.file = make("other") / other.file.filename();
    EXPECT_TRUE(write_file_durably(other.file, bytes));
    other.bytes = bytes.size();
    other.sha256 = sha256_hex(bytes);
    const auto put = open_target(config).value()->put(other, {});
    EXPECT_TRUE(put) << put.error().message();
    return fails(config, ErrorKind::bad_input);
  }
  /// Cuts the connection at 20 places, then lets it through.
  void survives_cuts(TargetConfig config, int from, int to, std::size_t most) {
    Random random(42);
    int cut = 0;
    for (int i = 0; i < 20; ++i) {
      const CuttingProxy proxy(from, to, random.below(most));
      const auto sent = deliver(config);
      if (sent) continue;
      EXPECT_EQ(sent.error().kind, ErrorKind::hardware) << sent.error().message();
      ++cut;
    }
    EXPECT_GT(cut, 5);
    const CuttingProxy proxy(from, to, std::size_t{1} << 40);
    EXPECT_EQ(arrives(config), "");
  }

  TemporaryFolder folder_;
};

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
  if (::mount("none", (folder_ / "dav").c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "nothing can be mounted here";
  }
  make("dav/in");
  {
    const auto server = start_nginx(folder_.path(), folder_ / "dav");
    EXPECT_THAT(fails(nginx(), ErrorKind::hardware), HasSubstr("HTTP 50"));
  }
  ::umount2((folder_ / "dav").c_str(), MNT_DETACH);
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
  if (::mount("none", (folder_ / "dav").c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "nothing can be mounted here";
  }
  make("dav/in");
  {
    const auto server = start_apache(folder_.path(), folder_ / "dav");
    TargetConfig config = nginx();
    config.address = "https://localhost:18445/in";
    EXPECT_NE(fails(config, ErrorKind::hardware), "it was delivered");
  }
  ::umount2((folder_ / "dav").c_str(), MNT_DETACH);
}

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
  if (::mount("none", make("in").c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "nothing can be mounted here";
  }
  EXPECT_NE(fails(sftp(), ErrorKind::hardware), "it was delivered");
  ::umount2((folder_ / "in").c_str(), MNT_DETACH);
}

class S3 : public Servers {
 protected:
  void SetUp() override { need({"/usr/bin/python3"}); }
  TargetConfig s3() {
    TargetConfig config = target(DeliveryProtocol::s3, "http://127.0.0.1:19000/case/from station");
    config.address = "http://127.0.0.1:19000/case/in";
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
  survives_cuts(dicom(18502), 18502, 14242, 40'000);
}

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
  survives_cuts(config, 18505, 18443, 8'000);
}

class Fhir : public Servers {
 protected:
  void SetUp() override { need({"/usr/bin/python3"}); }
  TargetConfig fhir() {
    TargetConfig config = target(DeliveryProtocol::fhir, "http://127.0.0.1:19001/fhir");
    config.secret = secret("token-1234");
    return config;
  }
};

TEST_F(Fhir, HoldsThePersonAndTheDocumentsOnce) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(fhir()), "");
  EXPECT_EQ(probe(fhir(), true), "");
  const auto opened = open_target(fhir()).value();
  const auto object = objects(fhir()).front();
  ASSERT_TRUE(opened->put(object, {})) << "a transaction twice";
  EXPECT_EQ(opened->read_back(object, {}).value(), object.sha256) << "and nothing is doubled";
  TargetConfig config = fhir();
  config.secret = secret("wrong");
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("refuses access"));
}

TEST_F(Fhir, OtherDocumentsUnderTheSameIdentifierAreFound) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  const auto another_package = [](std::string& text) {
    auto bundle = nlohmann::json::parse(text);
    auto& attachment = bundle["entry"].back()["resource"]["content"][0]["attachment"];
    attachment["extension"][0]["valueString"] = std::string(64, '0');
    text = bundle.dump();
  };
  EXPECT_THAT(finds_other_bytes(fhir(), another_package), HasSubstr("holds other bytes"));
}

TEST_F(Fhir, CutConnectionsLoseAndDoubleNothing) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  TargetConfig config = fhir();
  config.address = "http://127.0.0.1:18506/fhir";
  survives_cuts(config, 18506, 19001, 1'500);
}

TEST_F(Fhir, WhatTheServerSaysOfAMistakeIsPassedOn) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  auto object = objects(fhir()).front();
  std::string bundle = read_file(object.file).value();
  bundle.replace(bundle.find("\"current\""), 9, "\"present\"");
  ASSERT_TRUE(write_file_durably(object.file, bundle));
  const auto put = open_target(fhir()).value()->put(object, {});
  ASSERT_FALSE(put);
  EXPECT_THAT(put.error().message(), HasSubstr("HTTP 422): status"));
}

}  // namespace
}  // namespace skullstation
