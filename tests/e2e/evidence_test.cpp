// `skullstation package`, `verify`, `keys` and `audit` as their users call them, and kill -9 at
// random moments of packaging: never half a package. SKULLSTATION_LONG=1: 100 kills instead of 10.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/file.h"
#include "core/random.h"
#include "reconstruction/io/glb.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"
#include "tests/unit/evidence/time_stamp_authority.h"

namespace skullstation::testing {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

class Evidence : public ::testing::Test {
 protected:
  Evidence() { fs::copy(test_keys_folder(), folder_ / "keys"); }

  std::vector<std::string> package_words(const std::string& out) {
    return {"package",     folder_ / "case",
            "--session",   folder_ / "session",
            "--out",       folder_ / out,
            "--keys",      folder_ / "keys",
            "--by",        "Dr. Bone",
            "--audit-log", folder_ / "audit.jsonl",
            "--threads",   "2"};
  }
  /// trust.pem: the station's certificate and another one.
  void write_trust(const fs::path& other) {
    const std::string both =
        read_file(folder_ / "keys/certificate.pem").value() + read_file(other).value();
    ASSERT_TRUE(write_file_durably(folder_ / "trust.pem", both));
  }
  ProcessResult audit_verify(const std::vector<std::string>& packages) {
    std::vector<std::string> words = {"audit", "verify", folder_ / "audit.jsonl"};
    for (const std::string& package : packages) {
      words.insert(words.end(), {"--head", folder_ / package});
    }
    return skullstation_cli(words);
  }

  TemporaryFolder folder_;
};

TEST_F(Evidence, IsSealedVerifiedDamagedAndNamed) {
  write_small_case(folder_.path());
  auto words = package_words("bag");
  words.emplace_back("--json");
  const auto sealed = skullstation_cli(words);
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_EQ(nlohmann::json::parse(sealed.out)["files"], 7);
  const auto intact = skullstation_cli(
      {"verify", folder_ / "bag", "--trust", folder_ / "keys/certificate.pem", "--json"});
  EXPECT_EQ(intact.exit_code, 0) << intact.out;
  EXPECT_EQ(nlohmann::json::parse(intact.out)["trusted"], true);

  change_byte(folder_ / "bag/data/case/head.ply", 300'000, 1);
  const auto damaged = skullstation_cli({"verify", folder_ / "bag"});
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.out, HasSubstr("data/case/head.ply: is not as it was sealed; within bytes "
                                     "262144 to 524287"));
  EXPECT_THAT(damaged.out, HasSubstr("trust      not asked"));
  const auto json =
      nlohmann::json::parse(skullstation_cli({"verify", "--json", folder_ / "bag"}).out);
  EXPECT_EQ(json["intact"], false);
  EXPECT_EQ(json["findings"][0]["byte_ranges"], nlohmann::json::parse("[[262144,524288]]"));
}

TEST_F(Evidence, IsStampedByAnAuthorityOnTheNetwork) {
  const TimeStampAuthority authority(folder_ / "authority");
  const Process server({"/usr/bin/python3",
                        SKULLSTATION_SOURCE_DIR "/tests/e2e/time_stamp_server.py",
                        authority.folder().string()});
  const fs::path port_file = authority.folder() / "port";
  for (int i = 0; i < 600 && !fs::exists(port_file); ++i) std::this_thread::sleep_for(50ms);
  const std::string address = "http://127.0.0.1:" + read_file(port_file).value();
  write_small_case(folder_.path());
  const auto package = [&](const std::string& url) {
    auto words = package_words("bag");
    words.insert(words.end(), {"--time-stamp", url});
    return skullstation_cli(words);
  };
  const auto busy = package(address + "/busy");
  EXPECT_NE(busy.exit_code, 0);
  EXPECT_THAT(busy.err, HasSubstr("time stamp of " + address + "/busy: "));
  EXPECT_FALSE(fs::exists(folder_ / "bag"));
  const auto sealed = package(address + "/");
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_THAT(sealed.out, HasSubstr("signed, time stamped, in the audit log"));

  write_trust(authority.certificate());
  const auto verified =
      skullstation_cli({"verify", folder_ / "bag", "--trust", folder_ / "trust.pem"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_THAT(verified.out, HasSubstr("by the clock of CN = Authority, whom you trust"));
  fs::remove(folder_ / "bag/signature/time_stamp.tsr");
  const auto removed = skullstation_cli({"verify", folder_ / "bag"});
  EXPECT_EQ(removed.exit_code, 3);
  EXPECT_THAT(removed.out, HasSubstr("signature/time_stamp.tsr: is missing"));
}

TEST_F(Evidence, TheAuditLogIsShownAndVerifiedAgainstPackages) {
  write_small_case(folder_.path());
  ASSERT_EQ(skullstation_cli(package_words("bag1")).exit_code, 0);
  ASSERT_EQ(skullstation_cli(package_words("bag2")).exit_code, 0);
  const auto shown = skullstation_cli({"audit", "show", folder_ / "audit.jsonl", "--last", "1"});
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_THAT(shown.out, HasSubstr("Dr. Bone"));
  EXPECT_THAT(shown.out, Not(HasSubstr("log begun")));
  EXPECT_THAT(skullstation_cli({"audit", "show", folder_ / "audit.jsonl", "--case", "none"}).out,
              Not(HasSubstr("Dr. Bone")));
  EXPECT_EQ(audit_verify({"bag1", "bag2"}).exit_code, 0);

  std::string log = read_file(folder_ / "audit.jsonl").value();
  log.resize(log.rfind('\n', log.size() - 2) + 1);
  ASSERT_TRUE(write_file_durably(folder_ / "audit.jsonl", log));
  EXPECT_EQ(audit_verify({"bag1"}).exit_code, 0);
  const auto cut = audit_verify({"bag1", "bag2"});
  EXPECT_EQ(cut.exit_code, 3);
  EXPECT_THAT(cut.out, HasSubstr("its end was removed"));
  log[log.size() / 2] ^= 1;
  ASSERT_TRUE(write_file_durably(folder_ / "audit.jsonl", log));
  EXPECT_EQ(audit_verify({}).exit_code, 3);
  EXPECT_EQ(skullstation_cli({"audit", "show", folder_ / "audit.jsonl"}).exit_code, 3);
}

TEST_F(Evidence, NamesInAPackageCantSteerTheTerminal) {
  write_small_case(folder_.path());
  ASSERT_EQ(skullstation_cli(package_words("bag")).exit_code, 0);
  ASSERT_TRUE(write_file_durably(folder_ / "bag/data/\x1b[2J\xff", "x"));
  const auto checked = skullstation_cli({"verify", folder_ / "bag"});
  EXPECT_EQ(checked.exit_code, 3);
  EXPECT_THAT(checked.out, HasSubstr("data/?[2J"));
  EXPECT_THAT(checked.out, Not(HasSubstr("\x1b")));
  const auto json = skullstation_cli({"verify", "--json", folder_ / "bag"});
  EXPECT_EQ(nlohmann::json::parse(json.out)["findings"].size(), 1U);
}

TEST_F(Evidence, KeysAndLogCanStandInTheConfiguration) {
  write_small_case(folder_.path());
  const auto made =
      skullstation_cli({"keys", "create", folder_ / "new_keys", "--station", "ST-07", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto fingerprint = nlohmann::json::parse(made.out)["ed25519_key_sha256"].get<std::string>();
  ASSERT_TRUE(write_file_durably(folder_ / "station.toml",
                                 "[station]\nid = \"ST-07\"\n[evidence]\nkeys_folder = \"" +
                                     (folder_ / "new_keys").string() + "\"\naudit_log = \"" +
                                     (folder_ / "log.jsonl").string() + "\"\n"));
  const auto sealed = skullstation_cli({"package", folder_ / "case", "--out", folder_ / "bag",
                                        "--config", folder_ / "station.toml"});
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_THAT(skullstation_cli({"verify", folder_ / "bag"}).out, HasSubstr(fingerprint));
  EXPECT_THAT(skullstation_cli({"keys", "show", folder_ / "new_keys"}).out, HasSubstr(fingerprint));
  EXPECT_THAT(read_file(folder_ / "log.jsonl").value(), HasSubstr("\"station\":\"ST-07\""));
}

TEST_F(Evidence, ASealedCaseIsExhibited) {
  write_small_case(folder_.path());
  TriangleMesh head;
  head.vertices = Points3::Identity(3, 3);
  head.triangles.resize(1, 3);
  head.triangles << 0, 1, 2;
  ASSERT_TRUE(write_glb(head, folder_ / "case/head.glb"));
  ASSERT_EQ(skullstation_cli(package_words("bag")).exit_code, 0);
  ASSERT_TRUE(write_file_durably(folder_ / "station.toml",
                                 "[museum]\nrights_url = "
                                 "\"https://creativecommons.org/publicdomain/zero/1.0/\"\n"
                                 "base_url = \"https://museum.example/cases/\"\n"));
  const auto shown = skullstation_cli({"exhibit", folder_ / "bag", "--out", folder_ / "web/case 7/",
                                       "--config", folder_ / "station.toml", "--json"});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_EQ(nlohmann::json::parse(shown.out)["files"],
            nlohmann::json({"head.glb", "scene.svx.json", "manifest.json"}));
  const auto manifest =
      nlohmann::json::parse(read_file(folder_ / "web/case 7/manifest.json").value());
  EXPECT_EQ(manifest["id"], "https://museum.example/cases/case%207/manifest.json");
  EXPECT_EQ(manifest["rights"], "http://creativecommons.org/publicdomain/zero/1.0/");

  change_byte(folder_ / "bag/data/case/head.glb", 100, 1);
  const auto damaged = skullstation_cli({"exhibit", folder_ / "bag", "--out", folder_ / "new"});
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.err, HasSubstr("is not as it was sealed (data/case/head.glb"));
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(Evidence, MistakesAreNamed) {
  write_small_case(folder_.path());
  auto words = package_words("bag");
  fs::permissions(folder_ / "keys/ed25519.key", fs::perms::others_read, fs::perm_options::add);
  const auto open_key = skullstation_cli(words);
  EXPECT_EQ(open_key.exit_code, 3);
  EXPECT_THAT(open_key.err, HasSubstr("ed25519.key: is a private key that others may read"));
  fs::remove_all(folder_ / "keys");
  const auto no_keys = skullstation_cli(words);
  EXPECT_EQ(no_keys.exit_code, 3);
  EXPECT_THAT(no_keys.err, HasSubstr("skullstation keys create"));
  EXPECT_EQ(skullstation_cli({"verify", folder_ / "case"}).exit_code, 3);
  EXPECT_EQ(skullstation_cli({"audit", "verify", folder_ / "none"}).exit_code, 3);
  const auto no_key = skullstation_cli(
      {"audit", "verify", folder_ / "none", "--trust", test_keys_folder() / "certificate.pem"});
  EXPECT_EQ(no_key.exit_code, 3);
  EXPECT_THAT(no_key.err, HasSubstr("holds no public key"));
  EXPECT_EQ(skullstation_cli({"keys", "create", folder_ / "case", "--station", "X"}).exit_code, 2);
}

TEST_F(Evidence, SurvivesBeingKilledAtRandomMomentsOfPackaging) {
  const int kills_wanted = long_form() ? 100 : 10;
  write_small_case(folder_.path(), 24'000'000);
  std::vector<std::string> command = package_words("bag");
  command.insert(command.begin(), skullstation_program().string());
  Random random(20260131);
  int kills = 0;
  int finished = 0;
  std::chrono::milliseconds longest = 400ms;
  while (kills < kills_wanted) {
    ASSERT_LT(finished, 20 * kills_wanted) << "it is always done before it can be killed";
    Process package(command);
    const auto moment = random.below(static_cast<std::uint64_t>(longest.count()));
    if (!package.wait_for(std::chrono::milliseconds(moment))) {
      package.send(SIGKILL);
      kills += package.wait().exit_code == 128 + SIGKILL ? 1 : 0;
    }
    if (!fs::exists(folder_ / "bag")) {
      // On a slow machine it needs longer until there is something to lose.
      longest = std::min(longest + longest / 8, std::chrono::milliseconds(8000));
      continue;
    }
    ++finished;
    const auto checked = skullstation_cli({"verify", folder_ / "bag"});
    ASSERT_EQ(checked.exit_code, 0) << "half a package after " << kills << " kills\n"
                                    << checked.out;
    EXPECT_EQ(audit_verify({"bag"}).exit_code, 0);
    fs::remove_all(folder_ / "bag");
    longest = std::max(longest - longest / 8, 50ms);
  }
  ASSERT_EQ(Process(command).wait().exit_code, 0);
  EXPECT_EQ(skullstation_cli({"verify", folder_ / "bag"}).exit_code, 0);
  EXPECT_EQ(audit_verify({"bag"}).exit_code, 0);
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_THAT(entry.path().string(), Not(HasSubstr("unfinished")));
  }
  RecordProperty("kills", kills);
  RecordProperty("finished", finished);
}

}  // namespace
}  // namespace skullstation::testing
