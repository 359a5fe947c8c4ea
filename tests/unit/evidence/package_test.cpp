#include "daemon/evidence/package.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/evidence/package_check.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"
#include "tests/unit/evidence/time_stamp_authority.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::Process;
using testing::TemporaryFolder;

class Package : public ::testing::Test {
 protected:
  Result<PackageSummary> seal(const fs::path& out, int threads = 2) {
    return write_package(source_, {testing::test_keys(), audit_log_, "examiner", time_stamper_},
                         clock_, out, threads);
  }
  /// The error of sealing; nothing may be left of it.
  std::string refusal() {
    const auto sealed = seal(folder_ / "bag");
    EXPECT_FALSE(fs::exists(folder_ / "bag"));
    EXPECT_FALSE(fs::exists(folder_ / ".bag.unfinished"));
    return sealed ? "no error" : sealed.error().message();
  }
  std::string text(const fs::path& path) { return read_file(folder_ / path).value(); }

  TemporaryFolder folder_;
  SimulatedClock clock_;
  PackageSource source_ = testing::write_small_case(folder_.path());
  std::optional<AuditLogPlace> audit_log_ = AuditLogPlace{folder_ / "audit.jsonl", "ST-01"};
  TimeStamper time_stamper_;
};

TEST_F(Package, HoldsEveryFileAndSaysWhatItIs) {
  const auto sealed = seal(folder_ / "bag");
  ASSERT_TRUE(sealed) << sealed.error().message();
  EXPECT_EQ(sealed->case_number, "2026-0042");
  EXPECT_EQ(sealed->files, 10U);
  for (const char* file : {"case/head.ply", "case/variants/tissue_1_+2 100%.glb", "case/empty.csv",
                           "session/images/p0_c0_001.png", "reconstruction/skull.ply"}) {
    EXPECT_TRUE(text(file) == text(fs::path("bag/data") / file)) << file;
  }
  const auto metadata = nlohmann::json::parse(text("bag/metadata.json"));
  EXPECT_EQ(metadata["case"], "2026-0042");
  EXPECT_EQ(metadata["station"], "ST-01");
  EXPECT_EQ(metadata["model_card"], "Made of balls.");
  EXPECT_EQ(metadata["warnings"][0], "78 % observed");
  EXPECT_EQ(sealed->tag_manifest_sha256, sha256_hex(text("bag/tagmanifest-sha256.txt")));
}

TEST_F(Package, ProvenanceLeadsFromTheFaceToThePhotographs) {
  ASSERT_TRUE(seal(folder_ / "bag"));
  const auto prov = nlohmann::json::parse(text("bag/provenance.json"));
  const auto related = [&](const char* relation, const char* from, const std::string& what,
                           const char* to, const std::string& other) {
    return std::ranges::any_of(prov[relation], [&](const nlohmann::json& link) {
      return link[from] == what && link[to] == other;
    });
  };
  EXPECT_TRUE(related("wasGeneratedBy", "prov:entity", "sk:case/head.ply", "prov:activity",
                      "sk:approximate"));
  EXPECT_TRUE(related("used", "prov:activity", "sk:approximate", "prov:entity",
                      "sk:reconstruction/skull.ply"));
  EXPECT_TRUE(related("wasGeneratedBy", "prov:entity", "sk:reconstruction/skull.ply",
                      "prov:activity", "sk:reconstruct"));
  EXPECT_TRUE(related("used", "prov:activity", "sk:reconstruct", "prov:entity",
                      "sk:session/images/p0_c0_001.png"));
  EXPECT_TRUE(related("wasAssociatedWith", "prov:activity", "sk:scan", "prov:agent", "sk:station"));
  EXPECT_EQ(prov["entity"]["sk:model"]["sk:sha256"], std::string(64, 'b'));
  EXPECT_EQ(prov["agent"]["sk:approximate-program"]["sk:version"], "1.2.3");
  EXPECT_EQ(prov["activity"]["sk:approximate"]["sk:seed"], 7);
  EXPECT_EQ(prov["activity"]["sk:scan"]["prov:endTime"], "2026-01-31T12:00:01Z");
}

TEST_F(Package, ACaseAloneDrawsNoLinkThatNobodyRecorded) {
  source_.session.reset();
  source_.reconstruction.reset();
  ASSERT_TRUE(seal(folder_ / "bag"));
  const auto prov = nlohmann::json::parse(text("bag/provenance.json"));
  EXPECT_EQ(prov["entity"]["sk:skull"]["sk:in_this_package"], false);
  EXPECT_FALSE(prov["activity"].contains("sk:reconstruct"));
  EXPECT_FALSE(prov["activity"].contains("sk:scan"));
  // Without session and --case the folder's name has to do.
  EXPECT_EQ(nlohmann::json::parse(text("bag/metadata.json"))["case"], "case");
}

TEST_F(Package, IsTheSameBytesButForWhatCarriesTheTime) {
  ASSERT_TRUE(seal(folder_ / "one", 1));
  clock_.sleep_for(std::chrono::hours(1), {});
  ASSERT_TRUE(seal(folder_ / "two", 3));
  int compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "one")) {
    if (!entry.is_regular_file()) continue;
    const fs::path path = entry.path().lexically_relative(folder_ / "one");
    const bool timed = path == cms_file || path == audit_entry_file || path == signature_sums_file;
    EXPECT_EQ(text("one" / path) == text("two" / path), !timed) << path;
    ++compared;
  }
  EXPECT_EQ(compared, 10 + 13);
}

TEST_F(Package, IsAValidBagToAnIndependentCheck) {
  ASSERT_TRUE(seal(folder_ / "bag"));
  const std::string script = SKULLSTATION_SOURCE_DIR "/tests/unit/evidence/check_bag.py";
  const std::vector<std::string> check = {"/usr/bin/python3", script, folder_ / "bag"};
  const auto result = Process(check).wait();
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  // The check itself sees damage.
  testing::change_byte(folder_ / "bag/data/case/head.ply", 5, 1);
  EXPECT_THAT(Process(check).wait().out, HasSubstr("data/case/head.ply has another sum"));
}

TEST_F(Package, IsVerifiedByCoreutilsAndOpenssl) {
  ASSERT_TRUE(seal(folder_ / "bag"));
  const auto shell = [&](const std::string& command) {
    return Process({"/bin/sh", "-c", "cd " + (folder_ / "bag").string() + " && " + command})
        .wait()
        .exit_code;
  };
  const std::string ed25519 =
      "openssl pkeyutl -verify -pubin -inkey signature/ed25519.pub.pem -rawin "
      "-in tagmanifest-sha256.txt -sigfile signature/ed25519.sig";
  const std::string cms =
      "openssl cms -verify -binary -inform DER -in signature/cms.p7s "
      "-content tagmanifest-sha256.txt -CAfile signature/certificate.pem -purpose any "
      "-no_check_time -out /dev/null";
  EXPECT_EQ(shell("sha256sum --quiet -c tagmanifest-sha256.txt"), 0);
  EXPECT_EQ(shell("sed 's/%25/%/g' manifest-sha256.txt | sha256sum --quiet -c"), 0);
  EXPECT_EQ(shell(ed25519), 0);
  EXPECT_EQ(shell(cms), 0);
  EXPECT_EQ(shell("for s in $(split -b 256K --filter=sha256sum data/case/head.ply | "
                  "cut -d' ' -f1); do grep -q $s blocks-sha256.txt || exit 1; done"),
            0);
  testing::change_byte(folder_ / "bag/tagmanifest-sha256.txt", 3, 1);
  EXPECT_NE(shell(ed25519), 0);
  EXPECT_NE(shell(cms), 0);
}

TEST_F(Package, CarriesTheStampOfAnAuthority) {
  const testing::TimeStampAuthority authority(folder_ / "authority");
  time_stamper_ = authority.stamper();
  ASSERT_TRUE(seal(folder_ / "bag"));
  const auto trust = read_trust(authority.certificate());
  const auto checked = check_package(folder_ / "bag", *trust).value();
  ASSERT_TRUE(checked.time_stamp);
  EXPECT_EQ(checked.time_stamp->authority, "CN = Authority");
  EXPECT_EQ(checked.time_stamp_trusted, true);
  // The station's own keys are not among the trusted: that is the one finding.
  ASSERT_EQ(checked.findings.size(), 1U);
  EXPECT_EQ(checked.findings.front().fault, PackageFault::trust);
  const auto by_station = read_trust(testing::test_keys_folder() / "certificate.pem");
  const auto other = check_package(folder_ / "bag", *by_station).value();
  EXPECT_TRUE(other.findings.empty());
  EXPECT_EQ(other.time_stamp_trusted, false);
  EXPECT_EQ(check_package(folder_ / "bag", std::nullopt)->time_stamp_trusted, std::nullopt);
  // As an examiner without this program checks it.
  const auto openssl =
      Process({"/usr/bin/openssl", "ts", "-verify", "-data", (folder_ / "bag" / cms_file).string(),
               "-in", (folder_ / "bag" / time_stamp_file).string(), "-CAfile",
               authority.certificate().string()})
          .wait();
  EXPECT_EQ(openssl.exit_code, 0) << openssl.err;
}

TEST_F(Package, IsNotSealedWithoutTheStampThatWasAskedFor) {
  time_stamper_ = [](const std::string&) -> Result<std::string> {
    return fail(ErrorKind::hardware, "tsa.example", "does not answer");
  };
  EXPECT_THAT(refusal(), HasSubstr("time stamp of tsa.example: does not answer"));
  time_stamper_ = [](const std::string&) -> Result<std::string> { return "<html>"; };
  EXPECT_THAT(refusal(), HasSubstr("time stamp: is no answer of a time-stamping authority"));
}

TEST_F(Package, AuditEntryIsTheLogsHead) {
  ASSERT_TRUE(seal(folder_ / "bag"));
  const std::string entry = text("bag/signature/audit_entry.json");
  EXPECT_TRUE(text("audit.jsonl").ends_with("\n" + entry));
  const auto json = nlohmann::json::parse(entry);
  EXPECT_EQ(json["who"], "examiner");
  EXPECT_EQ(json["what"], "package");
  EXPECT_EQ(json["case"], "2026-0042");
  EXPECT_EQ(json["details"]["tagmanifest_sha256"], sha256_hex(text("bag/tagmanifest-sha256.txt")));
}

TEST_F(Package, APhotographThatWasChangedIsNotSealed) {
  testing::change_byte(folder_ / "session/images/p0_c0_001.png", 100, 1);
  EXPECT_THAT(refusal(), HasSubstr("p0_c0_001.png: is not the photograph that was taken"));
  fs::remove(folder_ / "session/images/p0_c0_001.png");
  EXPECT_THAT(refusal(), HasSubstr("p0_c0_001.png: is missing"));
}

TEST_F(Package, PartsThatDoNotBelongTogetherAreNotSealed) {
  source_.case_number = "2026-0043";
  EXPECT_THAT(refusal(), HasSubstr("is of case \"2026-0042\", not \"2026-0043\""));
  source_.case_number.clear();
  testing::change_byte(folder_ / "reconstruction/skull.ply", 100, 1);
  EXPECT_THAT(refusal(), HasSubstr("made from another skull"));
  ASSERT_TRUE(write_file_durably(
      folder_ / "reconstruction/cameras.json",
      R"({"format":"skullstation-session/1","cameras":[{"id":"c","width":9,"height":9}],)"
      R"("views":[{"image":"images/other.png","camera":"c"}]})"));
  EXPECT_THAT(refusal(), HasSubstr("images/other.png, which is no photograph of this session"));
}

TEST_F(Package, FoldersThatAreNotWhatTheyShouldBeAreNamed) {
  source_.case_folder = folder_ / "session";
  EXPECT_THAT(refusal(), HasSubstr("session: holds no case.json; give a folder that `skullstation "
                                   "approximate` made"));
  source_.case_folder = folder_ / "case";
  ASSERT_TRUE(write_file_durably(folder_ / "reconstruction/quality.json", "{}"));
  EXPECT_THAT(refusal(), HasSubstr("has not the format \"skullstation-reconstruction-quality/1\""));
  ASSERT_TRUE(write_file_durably(folder_ / "case/case.json", "{"));
  EXPECT_THAT(refusal(), HasSubstr("case.json: line 1"));
  source_.session = folder_ / "none";
  EXPECT_THAT(refusal(), HasSubstr("case.json"));
}

TEST_F(Package, LinksAndNamesThatABagCantHoldAreNamed) {
  fs::create_symlink("/etc/hostname", folder_ / "case/link");
  EXPECT_THAT(refusal(), HasSubstr("case/link: is neither a file nor a folder"));
  fs::remove(folder_ / "case/link");
  ASSERT_TRUE(write_file_durably(folder_ / "case/two\nlines", ""));
  EXPECT_THAT(refusal(), HasSubstr("its name holds a control character"));
  fs::remove(folder_ / "case/two\nlines");
  source_.case_number = "2026\n0042";
  source_.session.reset();
  EXPECT_THAT(refusal(), HasSubstr("one line of text"));
}

TEST_F(Package, IsNeverPutOverAnythingNorIntoWhatItSeals) {
  ASSERT_TRUE(seal(folder_ / "bag"));
  EXPECT_EQ(seal(folder_ / "bag").error().kind, ErrorKind::usage);
  for (const char* place : {"case/bag", "session/a/b", "case/../case/bag/"}) {
    const auto sealed = seal(folder_ / place);
    ASSERT_FALSE(sealed);
    EXPECT_THAT(sealed.error().message(), HasSubstr("which is to be sealed")) << place;
  }
  EXPECT_TRUE(seal(folder_ / "case-bag")) << "beside it is fine";
}

TEST_F(Package, ThatCantBeRecordedIsNotSealed) {
  audit_log_->file = folder_ / "no such folder" / "audit.jsonl";
  EXPECT_THAT(refusal(), HasSubstr("audit.jsonl: can't be written"));
}

TEST_F(Package, StopsOnRequestAndLeavesNothing) {
  std::stop_source stop;
  Progress progress;
  progress.report = [&](double fraction, std::string_view) {
    if (fraction > 0.1) stop.request_stop();
  };
  progress.stop = stop.get_token();
  const auto sealed = write_package(source_, {testing::test_keys(), audit_log_, "examiner", {}},
                                    clock_, folder_ / "bag", 2, progress);
  ASSERT_FALSE(sealed);
  EXPECT_EQ(sealed.error().kind, ErrorKind::cancelled);
  EXPECT_FALSE(fs::exists(folder_ / "bag"));
  EXPECT_FALSE(fs::exists(folder_ / ".bag.unfinished"));
  EXPECT_FALSE(fs::exists(folder_ / "audit.jsonl"));
}

}  // namespace
}  // namespace skullstation
