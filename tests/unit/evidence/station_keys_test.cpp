#include "daemon/evidence/station_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "daemon/evidence/cms_signature.h"
#include "daemon/evidence/signature.h"
#include "daemon/evidence/trust.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

fs::perms mode(const fs::path& path) { return fs::status(path).permissions(); }

std::string error_of(const fs::path& folder) {
  const auto keys = read_station_keys(folder);
  return keys ? "no error" : keys.error().message();
}

/// A folder of keys that a test may spoil.
class SpoiledKeys : public ::testing::Test {
 protected:
  SpoiledKeys() { fs::copy(testing::test_keys_folder(), keys_); }

  testing::TemporaryFolder folder_;
  fs::path keys_ = folder_ / "keys";
};

TEST(StationKeys, PrivateKeysAreForTheirOwnerAlone) {
  const fs::path& keys = testing::test_keys_folder();
  EXPECT_EQ(mode(keys), fs::perms::owner_all);
  for (const char* key : {"ed25519.key", "p256.key"}) {
    EXPECT_EQ(mode(keys / key), fs::perms::owner_read | fs::perms::owner_write) << key;
  }
}

TEST(StationKeys, AreNeverWrittenOverOthers) {
  EXPECT_EQ(create_station_keys(testing::test_keys_folder(), {"X"}, SystemClock()).error().kind,
            ErrorKind::usage);
}

TEST(StationKeys, NeedANameThatACertificateCanCarry) {
  const testing::TemporaryFolder folder;
  EXPECT_THAT(create_station_keys(folder / "a", {""}, SystemClock()).error().message(),
              HasSubstr("needs a name"));
  EXPECT_THAT(
      create_station_keys(folder / "b", {std::string(65, 'x')}, SystemClock()).error().message(),
      HasSubstr("64 characters"));
  EXPECT_FALSE(fs::exists(folder / "b"));
}

TEST(StationKeys, ThatAreNotThereSayHowToMakeThem) {
  EXPECT_THAT(error_of("nowhere"), HasSubstr("skullstation keys create nowhere --station NAME"));
}

TEST_F(SpoiledKeys, ReadableByOthersAreRefused) {
  fs::permissions(keys_ / "p256.key", fs::perms::group_read, fs::perm_options::add);
  EXPECT_THAT(error_of(keys_), HasSubstr("p256.key: is a private key that others may read or "
                                         "write (mode 640)"));
}

TEST_F(SpoiledKeys, OfAnotherKindOrEncryptedAreRefused) {
  fs::copy_file(keys_ / "p256.key", keys_ / "ed25519.key", fs::copy_options::overwrite_existing);
  EXPECT_THAT(error_of(keys_), HasSubstr("ed25519.key: is no Ed25519 key in PEM"));
  ASSERT_TRUE(write_file_durably(keys_ / "ed25519.key", "-----BEGIN ENCRYPTED PRIVATE KEY-----\n"));
  fs::permissions(keys_ / "ed25519.key", fs::perms::owner_read);
  EXPECT_THAT(error_of(keys_), HasSubstr("is encrypted"));
}

TEST_F(SpoiledKeys, WithTheCertificateOfAnotherKeyAreRefused) {
  ASSERT_TRUE(create_station_keys(folder_ / "other", {"TEST"}, SystemClock()));
  fs::copy_file(folder_ / "other/certificate.pem", keys_ / "certificate.pem",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(error_of(keys_), HasSubstr("does not belong to p256.key"));
  ASSERT_TRUE(write_file_durably(keys_ / "certificate.pem", "none"));
  EXPECT_THAT(error_of(keys_), HasSubstr("is no certificate"));
}

TEST(Ed25519, SignsOneMessageWithOneKey) {
  const StationKeys& keys = testing::test_keys();
  const std::string signature = ed25519_sign(keys, "message");
  EXPECT_EQ(signature.size(), 64U);
  EXPECT_EQ(signature, ed25519_sign(keys, "message"));
  EXPECT_TRUE(ed25519_verify(keys.ed25519_public_pem, "message", signature));
  EXPECT_FALSE(ed25519_verify(keys.ed25519_public_pem, "messagE", signature));
  EXPECT_FALSE(ed25519_verify(keys.ed25519_public_pem, "message", signature.substr(1)));
  EXPECT_FALSE(ed25519_verify("no key", "message", signature));
  EXPECT_EQ(public_key_fingerprint("no key"), "");
}

TEST(Hex, IsReadInOneFormOnly) {
  EXPECT_EQ(to_hex(std::string("\x00\xff", 2)), "00ff");
  EXPECT_EQ(from_hex("00ff", "x").value(), std::string("\x00\xff", 2));
  for (const char* wrong : {"0", "0F", "0g", "00f"}) EXPECT_FALSE(from_hex(wrong, "x")) << wrong;
}

TEST(Cms, CarriesTheSigningTimeAndRefusesAnExpiredCertificate) {
  const StationKeys& keys = testing::test_keys();
  const UtcTime now = SimulatedClock().utc_now() + std::chrono::hours(5);
  const auto signature = cms_sign(keys, "message", now);
  ASSERT_TRUE(signature) << signature.error().message();
  const auto signer = cms_verify(*signature, "message", keys.certificate_pem, "cms");
  ASSERT_TRUE(signer) << signer.error().message();
  EXPECT_EQ(signer->name, "CN = TEST");
  EXPECT_EQ(signer->signed_at, now);
  EXPECT_FALSE(cms_verify(*signature, "messagE", keys.certificate_pem, "cms"));
  EXPECT_FALSE(cms_verify("no CMS", "message", keys.certificate_pem, "cms"));
  EXPECT_FALSE(cms_verify(*signature, "message", "no certificate", "cms"));
  EXPECT_THAT(cms_sign(keys, "message", now + std::chrono::hours(24 * 3650)).error().message(),
              HasSubstr("certificate.pem: is valid from"));
  EXPECT_FALSE(cms_sign(keys, "message", now - std::chrono::hours(6)));
}

TEST_F(SpoiledKeys, AnAuthoritysCertificateMakesAStationsTrusted) {
  // An institution's own authority certifies the station's key, with the openssl command line.
  const std::string script =
      "set -e; cd " + folder_.path().string() +
      "; openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout ca.key "
      "-out ca.pem -days 30 -subj /CN=Lab -addext basicConstraints=critical,CA:TRUE 2>/dev/null"
      "; openssl req -new -key keys/p256.key -out s.csr -subj /CN=ST-01"
      "; openssl x509 -req -in s.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 20 "
      "-out keys/certificate.pem 2>/dev/null";
  ASSERT_EQ(testing::Process({"/bin/sh", "-c", script}).wait().exit_code, 0);
  const auto keys = read_station_keys(keys_);
  ASSERT_TRUE(keys) << keys.error().message();
  const UtcTime now = SystemClock().utc_now();
  const auto by_authority = read_trust(folder_ / "ca.pem");
  EXPECT_TRUE(trusts_certificate(*by_authority, keys->certificate_pem, now));
  EXPECT_THAT(
      trusts_certificate(*by_authority, keys->certificate_pem, now + std::chrono::hours(600))
          .error()
          .message(),
      HasSubstr("expired"));
  EXPECT_TRUE(
      trusts_certificate(*read_trust(keys_ / "certificate.pem"), keys->certificate_pem, now));
  const auto by_other = read_trust(testing::test_keys_folder() / "certificate.pem");
  EXPECT_THAT(trusts_certificate(*by_other, keys->certificate_pem, now).error().message(),
              HasSubstr("does not lead to a trusted certificate"));
}

TEST(Trust, IsReadFromPemOfEitherKind) {
  const testing::TemporaryFolder folder;
  const auto trust = read_trust(testing::test_keys_folder() / "ed25519.pub.pem");
  ASSERT_TRUE(trust);
  EXPECT_TRUE(trusts_key(*trust, testing::test_keys().ed25519_public_pem));
  EXPECT_FALSE(trusts_key(*trust, "no key"));
  ASSERT_TRUE(write_file_durably(folder / "none.pem", "nothing\n"));
  EXPECT_THAT(read_trust(folder / "none.pem").error().message(),
              HasSubstr("neither a certificate nor a public key"));
}

}  // namespace
}  // namespace skullstation
