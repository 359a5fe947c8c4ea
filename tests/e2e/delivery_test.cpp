// `skullstation deliver` as its users call it, and kill -9 of what sends at random moments: nothing
// lost, nothing doubled. SKULLSTATION_LONG=1: 100 kills instead of 10.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/random.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/delivery/sealed_case.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation::testing {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class Deliver : public ::testing::Test {
 protected:
  void seal(std::size_t large_bytes) {
    package_ = seal_small_case(folder_.path(), large_bytes);
    fs::create_directories(folder_ / "share");
    configure("");
  }
  void configure(const std::string& more) {
    fs::copy(test_keys_folder(), folder_ / "keys",
             fs::copy_options::skip_existing | fs::copy_options::recursive);
    ASSERT_TRUE(write_file_durably(
        folder_ / "station.toml",
        "[station]\nid = \"ST-01\"\n[evidence]\nkeys_folder = \"" + (folder_ / "keys").string() +
            "\"\naudit_log = \"" + (folder_ / "audit.jsonl").string() +
            "\"\n[delivery]\nfolder = \"" + (folder_ / "outbox").string() +
            "\"\n[[delivery.targets]]\nname = \"share\"\nprotocol = \"folder\"\naddress = \"" +
            (folder_ / "share").string() + "\"\n" + more));
  }
  std::vector<std::string> words(std::vector<std::string> words) {
    words.insert(words.begin(), "deliver");
    words.insert(words.end(), {"--config", folder_ / "station.toml"});
    return words;
  }
  ProcessResult deliver(const std::vector<std::string>& command) {
    return skullstation_cli(words(command));
  }
  json list() {
    const auto listed = deliver({"list", "--json"});
    EXPECT_EQ(listed.exit_code, 0) << listed.err;
    return json::parse(listed.out);
  }
  fs::path remote() const { return folder_ / "share" / package_.remote_name(); }

  TemporaryFolder folder_;
  SealedPackage package_;
};

TEST_F(Deliver, IsTriedSentListedHeldAndRetried) {
  seal(3000);
  const auto probed = deliver({"test", "share"});
  EXPECT_EQ(probed.exit_code, 0) << probed.err;
  EXPECT_THAT(probed.out, HasSubstr("read back and equal, and removed again"));
  fs::rename(folder_ / "share", folder_ / "away");
  const auto first = deliver({"send", package_.folder});
  EXPECT_EQ(first.exit_code, 4) << first.out << first.err;
  EXPECT_THAT(first.out, HasSubstr("see whether the share is mounted"));
  EXPECT_EQ(list()["oldest_undelivered"]["state"], "waiting");
  EXPECT_EQ(deliver({"hold", "1"}).exit_code, 0);
  EXPECT_EQ(deliver({"hold", "1"}).exit_code, 2);
  EXPECT_EQ(deliver({"send", package_.folder}).exit_code, 3) << "it is held";
  fs::rename(folder_ / "away", folder_ / "share");
  EXPECT_EQ(deliver({"retry", "1"}).exit_code, 0);
  EXPECT_EQ(deliver({"send", package_.folder, "--to", "share"}).exit_code, 0);
  const json rows = list();
  ASSERT_EQ(rows["deliveries"].size(), 1U) << "sent often, delivered once";
  EXPECT_EQ(rows["deliveries"][0]["state"], "delivered");
  EXPECT_EQ(rows["deliveries"][0]["attempts"], 2);
  EXPECT_EQ(rows["oldest_undelivered"], nullptr);
  EXPECT_EQ(skullstation_cli({"verify", remote()}).exit_code, 0);
  EXPECT_THAT(skullstation_cli({"audit", "show", folder_ / "audit.jsonl"}).out,
              HasSubstr("delivery"));
}

TEST_F(Deliver, MistakesAreNamed) {
  seal(0);
  EXPECT_THAT(deliver({"test", "shaer"}).err, HasSubstr("did you mean share?"));
  EXPECT_EQ(deliver({"retry", "7"}).exit_code, 2);
  EXPECT_EQ(deliver({"send", folder_ / "case"}).exit_code, 3);
  change_byte(package_.folder / "data/case/head.ply", 200, 1);
  const auto damaged = deliver({"send", package_.folder});
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.err, HasSubstr("nothing was sent"));
  EXPECT_TRUE(list()["deliveries"].empty());
  configure("password = \"x\"\n");
  EXPECT_THAT(deliver({"list"}).err, HasSubstr("unknown key \"delivery.targets[0].password\""));
}

/// Every file below a folder, and what a program printed, searched for a word.
bool somewhere(const fs::path& folder, const std::string& word) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    if (read_file(entry.path()).value().find(word) != std::string::npos) return true;
  }
  return false;
}

TEST_F(Deliver, NoSecretIsInOutboxLogsProcessListOrCoreDump) {
  seal(0);
  const std::string password = "Xyzzy-4711-do-not-tell";
  const TemporaryFolder elsewhere;
  ASSERT_TRUE(write_file_durably(elsewhere / "secret", password + "\n"));
  ::chmod((elsewhere / "secret").c_str(), 0600);
  std::string targets;
  // Nobody listens on port 1: the attempt fails with everything that there is to tell.
  for (const char* how : {"protocol = \"webdav\"\naddress = \"https://localhost:1/in\"",
                          "protocol = \"fhir\"\naddress = \"https://localhost:1/fhir\"",
                          "protocol = \"s3\"\naddress = \"https://localhost:1/b\"\nregion = \"r\"",
                          "protocol = \"sftp\"\naddress = \"sftp://localhost:1/in\"\n"
                          "host_key_sha256 = "
                          "\"SHA256:AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA\""}) {
    targets += std::string("[[delivery.targets]]\n") + how + "\nname = \"t" +
               std::to_string(targets.size()) + "\"\nuser = \"me\"\nsecret = \"" +
               (elsewhere / "secret").string() + "\"\n";
  }
  configure(targets);
  std::vector<std::string> command = words({"send", package_.folder});
  command.insert(command.begin(), skullstation_program().string());
  Process sending(command);
  const auto result = sending.wait();
  EXPECT_EQ(result.exit_code, 4) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("does not answer"));
  EXPECT_EQ(list()["deliveries"].size(), 5U);
  const auto shown = deliver({"list"});
  for (const std::string& text : {result.out, result.err, shown.out, shown.err}) {
    EXPECT_THAT(text, Not(HasSubstr(password)));
  }
  for (const std::string& word : command) EXPECT_THAT(word, Not(HasSubstr(password)));
  EXPECT_FALSE(somewhere(folder_.path(), password)) << "outbox, audit log, share, working folders";
  EXPECT_TRUE(somewhere(elsewhere.path(), password)) << "the search itself finds things";

  ::chmod((elsewhere / "secret").c_str(), 0640);
  const json failed = list();
  for (const auto& row : failed["deliveries"]) {
    if (row["state"] != "delivered") deliver({"retry", std::to_string(row["id"].get<int>())});
  }
  EXPECT_THAT(list().dump(), HasSubstr("that others may read"));
}

TEST_F(Deliver, SurvivesBeingKilledAtRandomMomentsOfSending) {
  const int kills_wanted = long_form() ? 100 : 10;
  seal(24'000'000);
  std::vector<std::string> command = words({"send", package_.folder});
  command.insert(command.begin(), skullstation_program().string());
  Random random(20260131);
  int kills = 0, finished = 0;
  std::chrono::milliseconds longest = 400ms;
  while (kills < kills_wanted) {
    ASSERT_LT(finished, 20 * kills_wanted) << "it is always done before it can be killed";
    Process send(command);
    if (!send.wait_for(
            std::chrono::milliseconds(random.below(static_cast<std::uint64_t>(longest.count()))))) {
      send.send(SIGKILL);
      kills += send.wait().exit_code == 128 + SIGKILL ? 1 : 0;
    }
    const json rows = list();
    ASSERT_LE(rows["deliveries"].size(), 1U) << "doubled after " << kills << " kills";
    if (rows["deliveries"].empty() || rows["deliveries"][0]["state"] != "delivered") {
      longest = std::min(longest + longest / 8, std::chrono::milliseconds(8000));
      continue;
    }
    ++finished;
    ASSERT_EQ(skullstation_cli({"verify", remote()}).exit_code, 0)
        << "told delivered and is not, after " << kills << " kills";
    fs::remove_all(folder_ / "share");
    fs::remove_all(folder_ / "outbox");
    fs::create_directories(folder_ / "share");
    longest = std::max(longest - longest / 8, 50ms);
  }
  ASSERT_EQ(Process(command).wait().exit_code, 0);
  EXPECT_EQ(skullstation_cli({"verify", remote()}).exit_code, 0);
  int packages = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "share")) packages += entry.exists();
  EXPECT_EQ(packages, 1);
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "share")) {
    EXPECT_FALSE(entry.path().string().ends_with(".part")) << entry.path();
  }
  EXPECT_EQ(skullstation_cli({"audit", "verify", folder_ / "audit.jsonl"}).exit_code, 0);
  RecordProperty("kills", kills);
  RecordProperty("finished", finished);
}

}  // namespace
}  // namespace skullstation::testing
