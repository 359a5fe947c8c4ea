#include "daemon/evidence/audit_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <thread>

#include "core/file.h"
#include "core/random.h"
#include "daemon/evidence/audit_check.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class AuditLog : public ::testing::Test {
 protected:
  Result<std::string> append(const std::string& what = "view") {
    return append_audit_entry({file_, "ST-01"}, {"examiner", what, "2026-0042", R"({"page":1})"},
                              testing::test_keys(), clock_);
  }
  /// A log of `count` entries, the first not counted; its lines with their line feeds.
  std::vector<std::string> lines(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(append("view " + std::to_string(i)));
    std::istringstream in(text());
    std::vector<std::string> all;
    for (std::string line; std::getline(in, line);) all.push_back(line + "\n");
    return all;
  }
  std::string text() { return read_file(file_).value_or(""); }
  static AuditCheck check(const std::string& log, const std::vector<AuditHead>& heads = {}) {
    std::istringstream in(log);
    return check_audit_log(in, std::nullopt, heads);
  }
  static std::string joined(const std::vector<std::string>& lines) {
    std::string all;
    for (const std::string& line : lines) all += line;
    return all;
  }
  static std::string first_finding(const std::string& log) {
    const AuditCheck checked = check(log);
    return checked.findings.empty() ? "nothing" : checked.findings.front().what;
  }

  testing::TemporaryFolder folder_;
  SimulatedClock clock_;
  const fs::path file_ = folder_ / "audit.jsonl";
};

TEST_F(AuditLog, IsAChainOfSignedLines) {
  const auto all = lines(3);
  ASSERT_THAT(all, SizeIs(4));
  const AuditEntry first = parse_audit_entry(all[0].substr(0, all[0].size() - 1), "").value();
  EXPECT_EQ(first.what, "log begun");
  EXPECT_EQ(public_key_of(first), testing::test_keys().ed25519_public_pem);
  const AuditEntry last = parse_audit_entry(all[3].substr(0, all[3].size() - 1), "").value();
  EXPECT_EQ(last.number, 4U);
  EXPECT_EQ(last.who, "examiner");
  EXPECT_EQ(last.subject, "2026-0042");
  EXPECT_EQ(last.details, R"({"page":1})");
  EXPECT_EQ(last.previous, sha256_hex(all[2].substr(0, all[2].size() - 1)));
  const AuditCheck checked = check(joined(all));
  EXPECT_THAT(checked.findings, IsEmpty());
  EXPECT_THAT(checked.notes, IsEmpty());
  EXPECT_EQ(checked.entries, 4U);
  EXPECT_EQ(checked.station, "ST-01");
}

TEST_F(AuditLog, EveryChangedByteIsFound) {
  const std::string whole = joined(lines(20));
  Random random(20260131);
  const int changes = testing::long_form() ? 1000 : 150;
  for (int i = 0; i < changes; ++i) {
    std::string changed = whole;
    const std::size_t offset = random.below(whole.size());
    changed[offset] = static_cast<char>(changed[offset] ^ (1 + random.below(255)));
    const AuditCheck checked = check(changed);
    const bool near = std::ranges::any_of(checked.findings, [&](const AuditFinding& f) {
      return f.begin <= offset + 1 && offset <= f.end;
    });
    EXPECT_TRUE(near) << "byte " << offset << " was not found";
  }
}

TEST_F(AuditLog, EveryByteOfTheLastLineIsCovered) {
  const auto all = lines(1);
  const std::string whole = joined(all);
  for (std::size_t i = whole.size() - all.back().size(); i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    EXPECT_THAT(check(changed).findings, ::testing::Not(IsEmpty())) << i;
  }
}

TEST_F(AuditLog, RemovalReorderingAndRepetitionAreFound) {
  const auto all = lines(5);
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    auto removed = all;
    removed.erase(removed.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_THAT(check(joined(removed)).findings, ::testing::Not(IsEmpty())) << i;
    auto swapped = all;
    std::swap(swapped[i], swapped[i + 1]);
    EXPECT_THAT(check(joined(swapped)).findings, ::testing::Not(IsEmpty())) << i;
    auto repeated = all;
    repeated.insert(repeated.begin() + static_cast<std::ptrdiff_t>(i), all[i]);
    EXPECT_THAT(check(joined(repeated)).findings, ::testing::Not(IsEmpty())) << i;
  }
  EXPECT_THAT(first_finding(all[0] + all[1] + all[4] + all[5]),
              HasSubstr("entries 3 to 4 are missing"));
  EXPECT_THAT(first_finding(all[0] + all[2] + all[1]), HasSubstr("entry 2 is missing"));
  EXPECT_THAT(first_finding(all[0] + all[1] + all[1]), HasSubstr("there twice"));
  EXPECT_THAT(first_finding(all[0] + "{}\n" + all[1]), HasSubstr("is no entry of this log"));
  EXPECT_THAT(first_finding(all[1]), HasSubstr("names no public key"));
  EXPECT_THAT(first_finding(""), HasSubstr("holds no entry"));
}

TEST_F(AuditLog, ARemovedEndShowsOnlyAgainstAnEntryKeptElsewhere) {
  const auto all = lines(5);
  const std::vector<AuditHead> head = {{"package A", all[4].substr(0, all[4].size() - 1)}};
  EXPECT_THAT(check(joined(all), head).findings, IsEmpty());
  auto cut = all;
  cut.resize(4);
  EXPECT_THAT(check(joined(cut)).findings, IsEmpty()) << "nothing in the log itself can tell";
  const AuditCheck checked = check(joined(cut), head);
  ASSERT_THAT(checked.findings, SizeIs(1));
  EXPECT_EQ(checked.findings[0].what,
            "the log ends with entry 4, and package A carries entry 5: its end was removed");
}

TEST_F(AuditLog, ALogWrittenAnewWithTheKeyShowsAgainstAnEntryKeptElsewhere) {
  const auto all = lines(3);
  const std::vector<AuditHead> head = {{"package A", all[2].substr(0, all[2].size() - 1)}};
  fs::remove(file_);
  ASSERT_TRUE(append("another history"));
  ASSERT_TRUE(append("of as many"));
  ASSERT_TRUE(append("entries"));
  const AuditCheck checked = check(text(), head);
  ASSERT_THAT(checked.findings, SizeIs(1));
  EXPECT_THAT(checked.findings[0].what, HasSubstr("entry 3 of this log is not the one"));
  EXPECT_THAT(check(text(), {{"a file", "no entry"}}).findings[0].what,
              HasSubstr("a file holds no entry"));
}

TEST_F(AuditLog, ACrashAtAnyByteIsSeenRecordedAndNeverFatal) {
  const auto all = lines(2);
  const std::string before = all[0] + all[1];
  const std::size_t step = testing::long_form() ? 1 : 13;
  for (std::size_t kept = 1; kept < all[2].size(); kept += step) {
    ASSERT_TRUE(write_file_durably(file_, before + all[2].substr(0, kept)));
    EXPECT_THAT(first_finding(text()), HasSubstr("is not complete")) << kept;
    ASSERT_TRUE(append("after the crash")) << kept;
    const AuditCheck checked = check(text());
    EXPECT_THAT(checked.findings, IsEmpty()) << kept;
    ASSERT_THAT(checked.notes, SizeIs(1)) << kept;
    EXPECT_THAT(checked.notes[0].what, HasSubstr("entry 3 recorded it"));
    EXPECT_TRUE(text().starts_with(before + all[2].substr(0, kept))) << "nothing was taken away";
  }
}

TEST_F(AuditLog, ACrashWhileACrashIsRecordedIsRecordedToo) {
  const auto all = lines(1);
  ASSERT_TRUE(write_file_durably(file_, all[0] + "{\"numb"));
  ASSERT_TRUE(append());
  const std::string recorded = text();
  const std::size_t step = testing::long_form() ? 1 : 31;
  for (std::size_t kept = all[0].size() + 7; kept < recorded.size(); kept += step) {
    ASSERT_TRUE(write_file_durably(file_, recorded.substr(0, kept)));
    ASSERT_TRUE(append("after two crashes")) << kept;
    const AuditCheck checked = check(text());
    EXPECT_THAT(checked.findings, IsEmpty()) << kept;
    EXPECT_THAT(checked.notes, SizeIs(1)) << kept;
  }
}

TEST_F(AuditLog, ACrashInTheFirstEntryIsRecordedToo) {
  ASSERT_TRUE(write_file_durably(file_, "{\"number\":1,"));
  ASSERT_TRUE(append());
  EXPECT_THAT(check(text()).findings, IsEmpty());
  EXPECT_THAT(check(text()).notes, SizeIs(1));
}

TEST_F(AuditLog, TornBytesCantBeChangedOrRemovedLater) {
  const auto all = lines(1);
  ASSERT_TRUE(write_file_durably(file_, all[0] + all[1] + "{\"number\":3,\"what\":\"deed\""));
  ASSERT_TRUE(append());
  std::string changed = text();
  const std::size_t deed = changed.find("deed");
  changed[deed] = 'D';
  EXPECT_THAT(first_finding(changed), HasSubstr("torn bytes before entry 3 were changed"));
  std::string removed = text();
  const std::size_t begin = all[0].size() + all[1].size();
  removed.erase(begin, removed.find('\n', begin) + 1 - begin);
  EXPECT_THAT(first_finding(removed), HasSubstr("torn bytes before entry 3 were changed"));
  EXPECT_THAT(first_finding(all[0] + "deed <torn>\n" + all[1]), HasSubstr("put in"));
  EXPECT_THAT(first_finding(all[0] + "deed <torn>\n"), HasSubstr("entries after it were removed"));
}

TEST_F(AuditLog, IsNotContinuedWhereItsEndIsDamaged) {
  const auto all = lines(2);
  std::string changed = joined(all);
  changed[changed.find("view 1")] = 'V';
  for (const std::string& log : {changed, joined(all) + "junk\n", std::string("junk\n")}) {
    ASSERT_TRUE(write_file_durably(file_, log));
    EXPECT_THAT(append().error().message(), HasSubstr("skullstation audit verify"));
    EXPECT_EQ(text(), log);
  }
}

TEST_F(AuditLog, IsNotContinuedWithAnotherKey) {
  lines(1);
  ASSERT_TRUE(create_station_keys(folder_ / "keys", {"X"}, clock_));
  const auto other = read_station_keys(folder_ / "keys");
  EXPECT_THAT(append_audit_entry({file_, "X"}, {"a", "b", "c"}, *other, clock_).error().message(),
              HasSubstr("another key"));
}

TEST_F(AuditLog, AnEntryThatCantBeWrittenIsRefused) {
  const auto refused = [&](const AuditEvent& event) {
    const auto entry = append_audit_entry({file_, "ST-01"}, event, testing::test_keys(), clock_);
    return entry ? "no error" : entry.error().message();
  };
  EXPECT_THAT(refused({"a", "b", "\xff", "{}"}), HasSubstr("no UTF-8"));
  EXPECT_THAT(refused({"a", "b", "c", "no JSON"}), HasSubstr("no JSON"));
  EXPECT_THAT(refused({"a", std::string(70000, 'x'), "c", "{}"}), HasSubstr("65536 is the most"));
  EXPECT_EQ(text(), "") << "not even the first entry";
}

TEST_F(AuditLog, LineFeedsInWordsStayInTheirEntry) {
  ASSERT_TRUE(append("two\nlines <torn>\n\""));
  EXPECT_THAT(check(text()).findings, IsEmpty());
  EXPECT_EQ(check(text()).entries, 2U);
}

TEST_F(AuditLog, TakesEntriesFromSeveralAtOnce) {
  std::vector<std::jthread> writers;
  for (int w = 0; w < 4; ++w) {
    writers.emplace_back([&] {
      for (int i = 0; i < 10; ++i) EXPECT_TRUE(append());
    });
  }
  writers.clear();
  const AuditCheck checked = check(text());
  EXPECT_THAT(checked.findings, IsEmpty());
  EXPECT_EQ(checked.entries, 41U);
}

TEST_F(AuditLog, AClockThatWentBackIsNoted) {
  clock_.sleep_for(std::chrono::hours(1), {});
  ASSERT_TRUE(append());
  const SimulatedClock earlier;
  ASSERT_TRUE(append_audit_entry({file_, "ST-01"}, {"a", "b", "c"}, testing::test_keys(), earlier));
  const AuditCheck checked = check(text());
  EXPECT_THAT(checked.findings, IsEmpty());
  ASSERT_THAT(checked.notes, SizeIs(1));
  EXPECT_THAT(checked.notes[0].what, HasSubstr("clock went back"));
}

TEST_F(AuditLog, TrustIsInKeysFromElsewhere) {
  lines(1);
  const auto own = read_trust(testing::test_keys_folder() / "ed25519.pub.pem").value();
  EXPECT_EQ(check_audit_file(file_, own, {})->key_trusted, true);
  ASSERT_TRUE(create_station_keys(folder_ / "keys", {"X"}, clock_));
  const auto other = read_trust(folder_ / "keys/ed25519.pub.pem").value();
  const auto checked = check_audit_file(file_, other, {});
  EXPECT_EQ(checked->key_trusted, false);
  EXPECT_THAT(checked->findings[0].what, HasSubstr("not among the trusted keys"));
}

TEST_F(AuditLog, ThatCantBeReadIsNamed) {
  EXPECT_THAT(check_audit_file(folder_ / "none", std::nullopt, {}).error().message(),
              HasSubstr("none: can't be read (No such file"));
  EXPECT_THAT(check_audit_file(folder_.path(), std::nullopt, {}).error().message(),
              HasSubstr("is a folder"));
}

}  // namespace
}  // namespace skullstation
