#include "daemon/evidence/package_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "core/random.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/signature.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A package that each test may damage.
class DamagedPackage : public ::testing::Test {
 protected:
  DamagedPackage() {
    const PackageSource source = testing::write_small_case(folder_.path());
    const auto sealed = write_package(
        source,
        {testing::test_keys(), AuditLogPlace{folder_ / "audit.jsonl", "ST-01"}, "examiner", {}},
        SimulatedClock(), bag_, 1);
    if (!sealed) throw std::runtime_error(sealed.error().message());
  }

  PackageCheck check(const std::optional<Trust>& trust = std::nullopt) {
    auto checked = check_package(bag_, trust);
    EXPECT_TRUE(checked) << checked.error().message();
    return checked.value_or(PackageCheck{});
  }
  /// The one thing that is wrong.
  PackageFinding finding() {
    const PackageCheck checked = check();
    EXPECT_THAT(checked.findings, SizeIs(1));
    for (const auto& f : checked.findings) last_ += f.file + ": " + f.what + "\n";
    return checked.findings.empty() ? PackageFinding{} : checked.findings.front();
  }
  /// Replaces a tag file and its sum in the tag manifest, as somebody without the keys could.
  void forge(const std::string& file, const std::string& bytes) {
    const std::string before = sha256_hex(*read_file(bag_ / file));
    ASSERT_TRUE(write_file_durably(bag_ / file, bytes));
    std::string manifest = *read_file(bag_ / tag_manifest_file);
    manifest.replace(manifest.find(before), before.size(), sha256_hex(bytes));
    ASSERT_TRUE(write_file_durably(bag_ / tag_manifest_file, manifest));
  }

  testing::TemporaryFolder folder_;
  const fs::path bag_ = folder_ / "bag";
  std::string last_;
};

TEST_F(DamagedPackage, NotDamagedIsAsItWasSealed) {
  const PackageCheck checked = check();
  EXPECT_THAT(checked.findings, IsEmpty());
  EXPECT_EQ(checked.case_number, "2026-0042");
  EXPECT_EQ(checked.files, 10U);
  EXPECT_TRUE(checked.ed25519_valid);
  EXPECT_EQ(checked.ed25519_fingerprint,
            public_key_fingerprint(testing::test_keys().ed25519_public_pem));
  ASSERT_TRUE(checked.cms_signer);
  EXPECT_EQ(checked.cms_signer->name, "CN = TEST");
  EXPECT_EQ(checked.cms_signer->signing_time, "2026-01-01T00:00:00.000Z");
  EXPECT_FALSE(checked.trusted) << "nobody was asked";
  ASSERT_TRUE(checked.audit_entry);
  EXPECT_EQ(checked.audit_entry->number, 2U);
}

TEST_F(DamagedPackage, WithoutAnAuditLogIsWholeToo) {
  const auto sealed = write_package(testing::write_small_case(folder_ / "again"),
                                    {testing::test_keys(), std::nullopt, "x", {}}, SimulatedClock(),
                                    folder_ / "bag2", 1);
  ASSERT_TRUE(sealed);
  const auto checked = check_package(folder_ / "bag2", std::nullopt);
  EXPECT_THAT(checked->findings, IsEmpty());
  EXPECT_FALSE(checked->audit_entry);
}

TEST_F(DamagedPackage, NamesTheFileAndTheBytes) {
  testing::change_byte(bag_ / "data/case/head.ply", block_bytes + 10, 1);
  const PackageFinding found = finding();
  EXPECT_EQ(found.fault, PackageFault::changed);
  EXPECT_EQ(found.file, "data/case/head.ply");
  EXPECT_THAT(found.ranges, ElementsAre(ByteRange{block_bytes, 2 * block_bytes}));
}

TEST_F(DamagedPackage, TellsAShortenedFromALengthenedFile) {
  fs::resize_file(bag_ / "data/case/head.ply", 100);
  PackageFinding found = finding();
  EXPECT_THAT(found.what, HasSubstr("it had 600000 bytes and has 100"));
  EXPECT_THAT(found.ranges, ElementsAre(ByteRange{0, 600000}));
}

TEST_F(DamagedPackage, NamesMissingExtraAndRenamedFiles) {
  fs::remove(bag_ / "data/case/empty.csv");
  EXPECT_EQ(finding().fault, PackageFault::missing);
  ASSERT_TRUE(write_file_durably(bag_ / "data/case/empty.csv", ""));
  ASSERT_TRUE(write_file_durably(bag_ / "data/case/new.csv", "new"));
  EXPECT_EQ(finding().fault, PackageFault::extra);
  fs::remove(bag_ / "data/case/new.csv");
  fs::rename(bag_ / "data/case/head.ply", bag_ / "data/face.ply");
  const PackageFinding renamed = finding();
  EXPECT_EQ(renamed.fault, PackageFault::renamed);
  EXPECT_EQ(renamed.file, "data/face.ply");
  EXPECT_EQ(renamed.what, "was sealed as data/case/head.ply");
}

TEST_F(DamagedPackage, TwoFilesThatChangedPlacesAreFound) {
  fs::rename(bag_ / "data/session/images/p0_c0_000.png", bag_ / "data/x");
  fs::rename(bag_ / "data/session/images/p0_c0_001.png",
             bag_ / "data/session/images/p0_c0_000.png");
  fs::rename(bag_ / "data/x", bag_ / "data/session/images/p0_c0_001.png");
  EXPECT_THAT(check().findings, SizeIs(2));
}

TEST_F(DamagedPackage, LinksAreNotFollowed) {
  fs::rename(bag_ / "data/case/head.ply", folder_ / "head.ply");
  fs::create_symlink(folder_ / "head.ply", bag_ / "data/case/head.ply");
  const PackageCheck checked = check();
  ASSERT_THAT(checked.findings, SizeIs(2));
  EXPECT_THAT(checked.findings[0].what, HasSubstr("is a link"));
  EXPECT_EQ(checked.findings[1].fault, PackageFault::missing);
}

TEST_F(DamagedPackage, AForgedManifestFailsBothSignatures) {
  std::string head = *read_file(bag_ / "data/case/head.ply");
  const std::string before = sha256_hex(head);
  head[7] = static_cast<char>(head[7] ^ 1);
  ASSERT_TRUE(write_file_durably(bag_ / "data/case/head.ply", head));
  std::string manifest = *read_file(bag_ / manifest_file);
  manifest.replace(manifest.find(before), 64, sha256_hex(head));
  forge(manifest_file, manifest);
  const PackageCheck checked = check();
  EXPECT_FALSE(checked.ed25519_valid);
  EXPECT_FALSE(checked.cms_signer);
  std::string files;
  for (const PackageFinding& f : checked.findings) files += f.file + " ";
  EXPECT_EQ(files, "signature/ed25519.sig signature/cms.p7s signature/audit_entry.json ");
}

TEST_F(DamagedPackage, ADamagedManifestIsToldFromADamagedFile) {
  std::string manifest = *read_file(bag_ / manifest_file);
  manifest[0] = manifest[0] == '0' ? '1' : '0';
  ASSERT_TRUE(write_file_durably(bag_ / manifest_file, manifest));
  const PackageCheck checked = check();
  ASSERT_THAT(checked.findings, SizeIs(2));
  EXPECT_EQ(checked.findings[0].file, manifest_file);
  EXPECT_THAT(checked.findings[1].what,
              HasSubstr("does not agree with manifest-sha256.txt, but with blocks-sha256.txt"));
}

TEST_F(DamagedPackage, MissingSealsAreNamed) {
  for (const char* seal : {ed25519_file, cms_file, audit_entry_file, signature_sums_file}) {
    fs::rename(bag_ / seal, folder_ / "aside");
    const PackageCheck checked = check();
    ASSERT_FALSE(checked.findings.empty()) << seal;
    EXPECT_EQ(checked.findings.back().fault, PackageFault::missing) << seal;
    EXPECT_EQ(checked.findings.back().file, seal);
    fs::rename(folder_ / "aside", bag_ / seal);
  }
  // With its line in the unsigned sums removed as well, the signed metadata still names it.
  std::string sums = *read_file(bag_ / signature_sums_file);
  ASSERT_TRUE(write_file_durably(bag_ / signature_sums_file, sums.substr(sums.find('\n') + 1)));
  fs::remove(bag_ / audit_entry_file);
  EXPECT_EQ(finding().file, audit_entry_file);
}

TEST_F(DamagedPackage, AStrangerInTheUnsignedSumsIsFound) {
  ASSERT_TRUE(write_file_durably(bag_ / "signature/note.txt", "x"));
  const std::string sums = *read_file(bag_ / signature_sums_file);
  const auto line = sha256_hex("x") + "  signature/note.txt\n";
  const auto place = sums.rfind(sha256_hex(*read_file(bag_ / ed25519_file)));
  ASSERT_TRUE(write_file_durably(bag_ / signature_sums_file, sums + line));
  EXPECT_NE(place, std::string::npos);
  EXPECT_THAT(check().findings.front().what, HasSubstr("no signature"));
}

TEST_F(DamagedPackage, TheAuditEntryOfAnotherPackageIsFound) {
  auto other = testing::write_small_case(folder_ / "other", 1000);
  const Seal seal{testing::test_keys(), AuditLogPlace{folder_ / "audit.jsonl", "ST-01"}, "x", {}};
  ASSERT_TRUE(write_package(other, seal, SimulatedClock(), folder_ / "bag2", 1));
  const std::string before = *read_file(bag_ / audit_entry_file);
  const std::string entry = *read_file(folder_ / "bag2" / audit_entry_file);
  std::string sums = *read_file(bag_ / signature_sums_file);
  sums.replace(sums.find(sha256_hex(before)), 64, sha256_hex(entry));
  ASSERT_TRUE(write_file_durably(bag_ / signature_sums_file, sums));
  ASSERT_TRUE(write_file_durably(bag_ / audit_entry_file, entry));
  EXPECT_EQ(finding().what, "is the audit entry of another package");
}

TEST_F(DamagedPackage, TrustIsInKeysFromElsewhere) {
  const fs::path& keys = testing::test_keys_folder();
  for (const char* own : {"ed25519.pub.pem", "certificate.pem"}) {
    const PackageCheck checked = check(read_trust(keys / own).value());
    EXPECT_THAT(checked.findings, IsEmpty()) << own;
    EXPECT_EQ(checked.trusted, true) << own;
  }
  ASSERT_TRUE(create_station_keys(folder_ / "keys", {"TEST"}, SimulatedClock()));
  for (const char* other : {"ed25519.pub.pem", "certificate.pem"}) {
    const PackageCheck checked = check(read_trust(folder_ / "keys" / other).value());
    ASSERT_THAT(checked.findings, SizeIs(1)) << other;
    EXPECT_EQ(checked.findings[0].fault, PackageFault::trust);
    EXPECT_EQ(checked.trusted, false);
  }
}

TEST_F(DamagedPackage, WhatIsNoPackageIsAnError) {
  EXPECT_THAT(check_package(folder_ / "none", std::nullopt).error().message(),
              HasSubstr("is no folder"));
  EXPECT_THAT(check_package(folder_ / "case", std::nullopt).error().message(),
              HasSubstr("holds no bagit.txt"));
}

/// Every byte of every file of a package, by a running number.
struct AllBytes {
  std::vector<std::pair<fs::path, std::uint64_t>> files;
  std::uint64_t total = 0;

  explicit AllBytes(const fs::path& folder) {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      files.emplace_back(entry.path(), entry.file_size());
      total += entry.file_size();
    }
    std::ranges::sort(files);
  }
};

/// Changes one byte, sees that it is found in the right file, changes it back.
void expect_found(const fs::path& bag, const fs::path& file, std::uint64_t offset,
                  unsigned char flip) {
  testing::change_byte(file, offset, flip);
  const auto checked = check_package(bag, std::nullopt);
  const std::string name = file.lexically_relative(bag).generic_string();
  bool named = !checked;  // a damaged bagit.txt, …
  for (const PackageFinding& f : checked ? checked->findings : std::vector<PackageFinding>{}) {
    const bool within = f.ranges.empty() || std::ranges::any_of(f.ranges, [&](const ByteRange& r) {
                          return offset >= r.begin && offset < r.end;
                        });
    named = named || (f.file == name && within) ||
            // What is made of the tag manifest can't agree with it any more.
            (name == tag_manifest_file && f.file.starts_with("signature/")) ||
            (name == signature_sums_file && f.file.starts_with("signature/"));
  }
  EXPECT_TRUE(named) << name << ", byte " << offset << " ^ " << int{flip} << " was not found";
  testing::change_byte(file, offset, flip);
}

TEST_F(DamagedPackage, EveryChangedByteIsFound) {
  Random random(20260131);
  const int changes = testing::long_form() ? 1000 : 120;
  const AllBytes all(bag_);
  for (int i = 0; i < changes; ++i) {
    // Half of them anywhere; half in a file chosen first, or the large ones would get them all.
    std::size_t file = random.below(all.files.size());
    std::uint64_t offset = all.files[file].second == 0 ? 0 : random.below(all.files[file].second);
    if (i % 2 == 0) {
      offset = random.below(all.total);
      for (file = 0; offset >= all.files[file].second; ++file) offset -= all.files[file].second;
    }
    if (all.files[file].second == 0) continue;
    expect_found(bag_, all.files[file].first, offset,
                 static_cast<unsigned char>(1 + random.below(255)));
  }
  EXPECT_THAT(check().findings, IsEmpty()) << "all changes were taken back";
}

TEST_F(DamagedPackage, EveryByteOfTheSealsIsCovered) {
  const int step = testing::long_form() ? 1 : 7;
  for (const char* seal : {ed25519_file, cms_file, signature_sums_file, audit_entry_file}) {
    const std::uint64_t size = fs::file_size(bag_ / seal);
    for (std::uint64_t offset = 0; offset < size; offset += static_cast<std::uint64_t>(step)) {
      expect_found(bag_, bag_ / seal, offset, 1);
    }
  }
}

}  // namespace
}  // namespace skullstation
